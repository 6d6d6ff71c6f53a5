// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/config_override.h"

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/shared_files.h"
#include "common/core/text.h"
#include "common/core/yaml_text.h"
#include "procedures/language/parameters.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

constexpr char separator[] = ".yaml:";

struct Place {
  fs::path file;
  std::string key;  ///< "beam.range_sigma"
};

Place place_of(const fs::path& config, const std::string& parameter) {
  const auto at = parameter.find(separator);
  const std::string name = parameter.substr(0, at + 5);
  const Place place{config / name, parameter.substr(at + 6)};
  const bool leaves = fs::path(name).is_absolute() || name.find("..") != std::string::npos;
  if (leaves || !fs::is_regular_file(place.file)) {
    throw InputError("'" + parameter + "': no file " + name + " in the configuration " +
                     config.string());
  }
  return place;
}

/// The value that a dotted key has.
YamlNode value_at(const YamlNode& root, const std::string& key, const std::string& file) {
  YamlNode node = root;
  std::istringstream words(key);
  for (std::string word; std::getline(words, word, '.');) {
    if (!node.has(word)) {
      std::vector<std::string> known;
      for (const auto& entry : node.entries()) known.push_back(entry.first.text());
      throw InputError(file + ": no key '" + word + "' of '" + key +
                       "'; there are: " + (known.empty() ? "none" : joined(known)));
    }
    node = node.at(word);
  }
  return node;
}

/// The map with another value of a dotted key that it has.
YamlNode with_value(const YamlNode& map, const std::string& key, const YamlNode& value) {
  const auto dot = key.find('.');
  const std::string word = key.substr(0, dot);
  YamlNode copy(YamlNode::Kind::map);
  for (const auto& [name, old] : map.entries()) copy.add(name, old);
  copy.put(word,
           dot == std::string::npos ? value : with_value(map.at(word), key.substr(dot + 1), value));
  return copy;
}

std::string overridden(const Place& place, const std::string& parameter, const std::string& value) {
  const std::string file = place.file.string();
  const std::string text = clean_text(read_file(place.file), file);
  const YamlNode root = read_yaml(text, file);
  const YamlNode before = value_at(root, place.key, file);
  if (before.is_map() || before.is_nothing()) {
    throw InputError("'" + parameter + "': is no single value in " + file);
  }
  const YamlNode now = procedures::value_in_place_of(before, value, "'" + parameter + "'");
  const auto span = span_of(text, before);
  if (!span) throw InputError("'" + parameter + "': is not written on one line in " + file);
  const auto result = edited(text, {{*span, now}}, with_value(root, place.key, now));
  if (!result) throw InputError("'" + parameter + "': cannot be replaced in " + file);
  return *result;
}

}  // namespace

bool names_configuration(const std::string& parameter) {
  return parameter.find(separator) != std::string::npos;
}

std::map<std::string, std::string> of_procedure(
    const std::map<std::string, std::string>& parameters) {
  auto own = parameters;
  std::erase_if(own, [](const auto& item) { return names_configuration(item.first); });
  return own;
}

void override_configuration(const fs::path& config,
                            const std::map<std::string, std::string>& parameters) {
  for (const auto& [name, value] : parameters) {
    if (!names_configuration(name)) continue;
    const Place place = place_of(config, name);
    write_file(place.file, overridden(place, name, value));
  }
}

void check_override(const fs::path& config, const std::string& parameter,
                    const std::string& value) {
  overridden(place_of(config, parameter), parameter, value);
}

void put_calibration(const fs::path& config, const std::string& layout, const fs::path& file) {
  if (file.empty()) return;
  const std::string text = read_file(file);
  fs::create_directories(config / "calibration");
  write_file(config / "calibration" / (layout + ".yaml"), text);
}

ChangedConfiguration::ChangedConfiguration(const fs::path& config,
                                           const std::map<std::string, std::string>& parameters,
                                           const std::string& layout, const fs::path& calibration)
    : directory_(config) {
  const bool changes = std::any_of(parameters.begin(), parameters.end(), [](const auto& item) {
    return names_configuration(item.first);
  });
  if (!changes && calibration.empty()) return;
  std::string name = (temporary_directory() / "berth-config-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw InputError(name + ": cannot be made");
  directory_ = name;
  is_copy_ = true;
  try {
    copy_writable(config, directory_);
    override_configuration(directory_, parameters);
    put_calibration(directory_, layout, calibration);
  } catch (...) {
    fs::remove_all(directory_);
    throw;
  }
}

ChangedConfiguration::~ChangedConfiguration() {
  std::error_code ignored;
  if (is_copy_) fs::remove_all(directory_, ignored);
}

}  // namespace berth
