// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/config.h"

#include <algorithm>

#include "common/core/file.h"
#include "common/core/nearest_word.h"
#include "common/core/text.h"

namespace berth {
namespace {

std::string shown(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      return "'" + node.Scalar() + "'";
    case YAML::NodeType::Sequence:
      return "a list of " + std::to_string(node.size());
    case YAML::NodeType::Map:
      return "a map";
    default:
      return "nothing";
  }
}

/// yaml-cpp keeps the last of two equal keys; for us that is a mistake of the writer.
void refuse_repeated_keys(const YAML::Node& node, const std::string& file) {
  if (node.IsSequence()) {
    for (const auto& item : node) refuse_repeated_keys(item, file);
  }
  if (!node.IsMap()) return;
  std::set<std::string> seen;
  for (const auto& item : node) {
    if (!item.first.IsScalar() || !seen.insert(item.first.Scalar()).second) {
      throw InputError(file + ":" + std::to_string(item.first.Mark().line + 1) + ": key " +
                       shown(item.first) + " appears twice or is not a word");
    }
    refuse_repeated_keys(item.second, file);
  }
}

}  // namespace

Config::Config(const YAML::Node& node, std::string file, std::string prefix)
    : node_(node), file_(std::move(file)), prefix_(std::move(prefix)) {}

Config Config::load(const std::filesystem::path& path) {
  return parse(read_file(path), path.string());
}

Config Config::parse(const std::string& text, const std::string& name) {
  YAML::Node node;
  try {
    node = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw InputError(name + ":" + std::to_string(e.mark.line + 1) + ": not YAML: " + e.msg);
  }
  if (!node.IsMap())
    throw InputError(name + ":1: found " + shown(node) + ", expected a map of keys");
  refuse_repeated_keys(node, name);
  return {node, name, ""};
}

int Config::line() const { return node_.Mark().line + 1; }

InputError Config::error(const std::string& key, const std::string& what) const {
  int at = line();
  const YAML::Node& map = node_;
  for (const auto& item : map) {
    if (item.first.Scalar() == key) at = item.first.Mark().line + 1;
  }
  return InputError(file_ + ":" + std::to_string(at) + ": key '" + prefix_ + key + "': " + what);
}

bool Config::has(const std::string& key) const {
  const YAML::Node& map = node_;  // operator[] of a non-const node would add the key
  return static_cast<bool>(map[key]);
}

bool Config::known(const std::string& key) {
  read_.insert(key);
  return has(key);
}

std::vector<std::string> Config::keys() const {
  std::vector<std::string> names;
  for (const auto& item : node_) names.push_back(item.first.Scalar());
  return names;
}

YAML::Node Config::raw(const std::string& key) {
  read_.insert(key);
  const YAML::Node& map = node_;
  return map[key];
}

YAML::Node Config::require(const std::string& key) {
  if (!has(key)) throw error(key, "is missing");
  return raw(key);
}

double Config::convert(const YAML::Node& node, const std::string& key, Dimension dimension) const {
  if (!node.IsScalar()) {
    throw error(key, "found " + shown(node) + ", expected " + describe(dimension));
  }
  try {
    return parse_quantity(node.Scalar(), dimension);
  } catch (const InputError& e) {
    throw error(key, e.what());
  }
}

double Config::quantity(const std::string& key, Dimension dimension) {
  return convert(require(key), key, dimension);
}

std::int64_t Config::integer(const std::string& key) {
  const YAML::Node node = require(key);
  std::int64_t value = 0;
  if (!node.IsScalar() || !YAML::convert<std::int64_t>::decode(node, value)) {
    throw error(key, "found " + shown(node) + ", expected a whole number");
  }
  return value;
}

bool Config::boolean(const std::string& key) {
  const YAML::Node node = require(key);
  if (node.IsScalar() && node.Scalar() == "true") return true;
  if (node.IsScalar() && node.Scalar() == "false") return false;
  throw error(key, "found " + shown(node) + ", expected true or false");
}

std::string Config::text(const std::string& key) {
  const YAML::Node node = require(key);
  if (!node.IsScalar()) throw error(key, "found " + shown(node) + ", expected a text");
  return node.Scalar();
}

std::string Config::choice(const std::string& key, const std::vector<std::string>& words) {
  const std::string found = text(key);
  if (std::find(words.begin(), words.end(), found) != words.end()) return found;
  throw error(key, "found '" + found + "', expected one of: " + joined(words));
}

std::vector<double> Config::quantities(const std::string& key, Dimension dimension) {
  const YAML::Node node = require(key);
  if (!node.IsSequence()) {
    throw error(key, "found " + shown(node) + ", expected a list, each " + describe(dimension));
  }
  std::vector<double> values;
  for (const auto& item : node) values.push_back(convert(item, key, dimension));
  return values;
}

Pose Config::pose(const std::string& key) {
  const auto values = quantities(key, Dimension::number);
  if (values.size() != 6) {
    throw error(key, "found a list of " + std::to_string(values.size()) +
                         ", expected [x, y, z, w, p, r] in mm and degrees");
  }
  Xyzwpr xyzwpr;
  std::copy(values.begin(), values.end(), xyzwpr.begin());
  return pose_from_xyzwpr(xyzwpr);
}

Vector3d Config::vector(const std::string& key, Dimension dimension) {
  const auto values = quantities(key, dimension);
  if (values.size() != 3) {
    throw error(key, "found a list of " + std::to_string(values.size()) +
                         ", expected three values, each " + describe(dimension));
  }
  return {values[0], values[1], values[2]};
}

std::vector<std::string> Config::texts(const std::string& key) {
  const YAML::Node node = require(key);
  if (!node.IsSequence()) throw error(key, "found " + shown(node) + ", expected a list of texts");
  std::vector<std::string> values;
  for (const auto& item : node) {
    if (!item.IsScalar()) throw error(key, "found " + shown(item) + ", expected a text");
    values.push_back(item.Scalar());
  }
  return values;
}

Config Config::section(const std::string& key) {
  const YAML::Node node = require(key);
  if (!node.IsMap()) throw error(key, "found " + shown(node) + ", expected a map of keys");
  return {node, file_, prefix_ + key + "."};
}

std::vector<Config> Config::sections(const std::string& key) {
  std::vector<Config> list;
  if (!has(key)) return list;
  const YAML::Node node = raw(key);
  if (!node.IsSequence()) throw error(key, "found " + shown(node) + ", expected a list");
  for (std::size_t i = 0; i < node.size(); ++i) {
    if (!node[i].IsMap()) throw error(key, "found " + shown(node[i]) + ", expected a map of keys");
    list.push_back({node[i], file_, prefix_ + key + "[" + std::to_string(i) + "]."});
  }
  return list;
}

void Config::optional(const std::string& key, Dimension dimension, double& value) {
  if (known(key)) value = quantity(key, dimension);
}
void Config::optional(const std::string& key, int& value) {
  if (known(key)) value = static_cast<int>(integer(key));
}
void Config::optional(const std::string& key, std::int64_t& value) {
  if (known(key)) value = integer(key);
}
void Config::optional(const std::string& key, bool& value) {
  if (known(key)) value = boolean(key);
}
void Config::optional(const std::string& key, std::string& value) {
  if (known(key)) value = text(key);
}
void Config::optional(const std::string& key, Pose& value) {
  if (known(key)) value = pose(key);
}

void Config::finish() const {
  for (const auto& key : keys()) {
    if (read_.count(key) != 0) continue;
    const std::string nearest = nearest_word(key, {read_.begin(), read_.end()});
    throw error(
        key, "is not known here" + (!nearest.empty() ? "; did you mean '" + nearest + "'?" : ""));
  }
}

}  // namespace berth
