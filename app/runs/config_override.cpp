// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/config_override.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/quantity.h"
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

/// The value that a dotted key has. A const node: operator[] of another would add the key.
YAML::Node value_at(const YAML::Node& root, const std::string& key, const std::string& file) {
  YAML::Node node = root;
  std::istringstream words(key);
  for (std::string word; std::getline(words, word, '.');) {
    const YAML::Node& map = node;
    const YAML::Node next = map.IsMap() ? map[word] : YAML::Node(YAML::NodeType::Undefined);
    if (!next.IsDefined()) {
      std::string known;
      if (map.IsMap()) {
        for (const auto& item : map) known += (known.empty() ? "" : ", ") + item.first.Scalar();
      }
      throw InputError(file + ": no key '" + word + "' of '" + key +
                       "'; there are: " + (known.empty() ? "none" : known));
    }
    node.reset(next);
  }
  return node;
}

void check_kind(const YAML::Node& before, const YAML::Node& now, const std::string& parameter) {
  const auto wrong = [&](const std::string& expected) {
    return InputError("'" + parameter + "': found '" + YAML::Dump(now) + "', expected " + expected);
  };
  if (before.IsSequence()) {
    if (!now.IsSequence() || now.size() != before.size()) {
      throw wrong("a list such as '" + YAML::Dump(before) + "'");
    }
    return;
  }
  if (!now.IsScalar()) throw wrong("one value such as '" + YAML::Dump(before) + "'");
  const auto dimension = procedures::dimension_of(before.Scalar());
  if (!dimension) return;
  try {
    parse_quantity(now.Scalar(), *dimension);
  } catch (const InputError& e) {
    throw InputError("'" + parameter + "': " + e.what());
  }
}

/// Where the value that starts at `begin` ends: a list in brackets, a text in quotes, or a word up
/// to a comment, a comma, a brace or the line's end.
std::size_t end_of_value(const std::string& text, std::size_t begin, const YAML::Node& value) {
  if (value.IsSequence()) return text[begin] == '[' ? text.find(']', begin) + 1 : std::string::npos;
  if (text[begin] == '"' || text[begin] == '\'') return text.find(text[begin], begin + 1) + 1;
  return begin + value.Scalar().size();
}

std::string overridden(const Place& place, const std::string& parameter, const std::string& value) {
  const std::string text = read_file(place.file);
  const std::string file = place.file.string();
  const YAML::Node before = value_at(YAML::Load(text), place.key, file);
  if (before.IsMap() || before.IsNull()) {
    throw InputError("'" + parameter + "': is no single value in " + file);
  }
  if (value.empty() || value.find_first_of("\n\"'#{}") != std::string::npos) {
    throw InputError("'" + parameter + "': found '" + value + "', expected plain text");
  }
  YAML::Node now;
  try {
    now = YAML::Load(value);
  } catch (const YAML::Exception& e) {
    throw InputError("'" + parameter + "': found '" + value + "': " + e.msg);
  }
  check_kind(before, now, parameter);
  const auto begin = static_cast<std::size_t>(before.Mark().pos);
  const std::size_t end = end_of_value(text, begin, before);
  if (end == std::string::npos || end <= begin) {
    throw InputError("'" + parameter + "': is not written on one line in " + file);
  }
  const std::string result = text.substr(0, begin) + value + text.substr(end);
  // Whatever way the file was written: it says what was asked for, or nothing is written.
  if (YAML::Dump(value_at(YAML::Load(result), place.key, file)) != YAML::Dump(now)) {
    throw InputError("'" + parameter + "': cannot be replaced in " + file);
  }
  return result;
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
    fs::copy(config, directory_, fs::copy_options::recursive);
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
