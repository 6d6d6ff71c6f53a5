// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/config.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include "common/core/file.h"
#include "common/core/nearest_word.h"
#include "common/core/renamed_keys.h"
#include "common/core/text.h"

namespace berth {
namespace {

/// A whole number as people write it, with or without a sign and leading zeros; 0x1F and 0o17 as in
/// YAML; what a program wrote as 1e3. Nothing for other text, and for what no std::int64_t holds.
std::optional<std::int64_t> whole_number(const std::string& text) {
  std::string_view digits = text;
  const bool negative = digits.substr(0, 1) == "-";
  if (negative || digits.substr(0, 1) == "+") digits.remove_prefix(1);
  int base = 10;
  if (digits.substr(0, 2) == "0x") base = 16;
  if (digits.substr(0, 2) == "0o") base = 8;
  if (base != 10) digits.remove_prefix(2);
  const char* const end = digits.data() + digits.size();
  std::uint64_t size = 0;
  const auto read = std::from_chars(digits.data(), end, size, base);
  constexpr auto most = std::uint64_t{1} << 63U;
  if (read.ec == std::errc() && read.ptr == end) {
    if (size > most || (size == most && !negative)) return std::nullopt;
    return static_cast<std::int64_t>(negative ? 0 - size : size);
  }
  constexpr double exact = 9007199254740992;  // above it a double tells no two whole numbers apart
  double value = -1;
  const auto real = std::from_chars(digits.data(), end, value);
  const bool whole = real.ec == std::errc() && real.ptr == end && value == std::floor(value) &&
                     value >= 0 && value <= exact && base == 10;
  if (!whole) return std::nullopt;
  return static_cast<std::int64_t>(negative ? -value : value);
}

}  // namespace

Config::Config(const YamlNode& node, std::string file, std::string prefix)
    : node_(node), file_(std::move(file)), prefix_(std::move(prefix)) {}

Config::Config(const YamlNode& node, std::string file) : Config(node, std::move(file), "") {
  if (node.is_map()) return;
  throw InputError(file_ + ":" + std::to_string(line()) + ": found " + shown(node) +
                   ", expected a map of keys");
}

Config Config::load(const std::filesystem::path& path) {
  return parse(read_file(path), path.string());
}

Config Config::parse(const std::string& text, const std::string& name) {
  return {read_yaml(text, name), name};
}

Config Config::holding(const YamlNode& node) const { return {node, file_, prefix_}; }

int Config::line() const { return node_.line(); }

InputError Config::error(const std::string& key, const std::string& what) const {
  int at = line();
  for (const auto& [name, value] : node_.entries()) {
    if (name.text() == key) at = name.line();
  }
  return InputError(file_ + ":" + std::to_string(at) + ": key '" + prefix_ + key + "': " + what);
}

bool Config::has(const std::string& key) const { return node_.has(key); }

bool Config::known(const std::string& key) {
  read_.insert(key);
  if (has(key)) return true;
  for (const auto& [before, value] : node_.entries()) {
    if (present_name(prefix_ + before.text()) == key) expect_present_name(before.text());
  }
  return false;
}

std::vector<std::string> Config::keys() const {
  std::vector<std::string> names;
  for (const auto& [name, value] : node_.entries()) names.push_back(name.text());
  return names;
}

YamlNode Config::raw(const std::string& key) {
  read_.insert(key);
  return node_.at(key);
}

YamlNode Config::require(const std::string& key) {
  if (!known(key)) throw error(key, "is missing");
  return raw(key);
}

double Config::convert(const YamlNode& node, const std::string& key, Dimension dimension) const {
  if (!node.is_text()) {
    throw error(key, "found " + shown(node) + ", expected " + describe(dimension));
  }
  try {
    return parse_quantity(node.text(), dimension);
  } catch (const InputError& e) {
    throw error(key, e.what());
  }
}

double Config::quantity(const std::string& key, Dimension dimension) {
  return convert(require(key), key, dimension);
}

std::int64_t Config::whole(const YamlNode& node, const std::string& key, std::int64_t least,
                           std::int64_t most) const {
  const auto value = node.is_text() ? whole_number(node.text()) : std::nullopt;
  if (!value) throw error(key, "found " + shown(node) + ", expected a whole number");
  if (*value >= least && *value <= most) return *value;
  throw error(key, "found " + shown(node) + ", expected a whole number from " +
                       std::to_string(least) + " to " + std::to_string(most));
}

std::int64_t Config::integer(const std::string& key) {
  return whole(require(key), key, std::numeric_limits<std::int64_t>::min(),
               std::numeric_limits<std::int64_t>::max());
}

int Config::small_integer(const std::string& key) {
  return static_cast<int>(
      whole(require(key), key, std::numeric_limits<int>::min(), std::numeric_limits<int>::max()));
}

std::vector<std::int64_t> Config::integers(const std::string& key) {
  const YamlNode node = require(key);
  if (!node.is_list()) throw error(key, "found " + shown(node) + ", expected a list");
  std::vector<std::int64_t> values;
  for (const YamlNode& item : node.items()) {
    values.push_back(whole(item, key, std::numeric_limits<std::int64_t>::min(),
                           std::numeric_limits<std::int64_t>::max()));
  }
  return values;
}

bool Config::boolean(const std::string& key) {
  const YamlNode node = require(key);
  if (node.is_text() && node.text() == "true") return true;
  if (node.is_text() && node.text() == "false") return false;
  throw error(key, "found " + shown(node) + ", expected true or false");
}

std::string Config::text(const std::string& key) {
  const YamlNode node = require(key);
  if (!node.is_text()) throw error(key, "found " + shown(node) + ", expected a text");
  return node.text();
}

std::string Config::choice(const std::string& key, const std::vector<std::string>& words) {
  const std::string found = text(key);
  if (std::find(words.begin(), words.end(), found) != words.end()) return found;
  throw error(key, "found '" + found + "', expected one of: " + joined(words));
}

std::vector<double> Config::quantities(const std::string& key, Dimension dimension) {
  const YamlNode node = require(key);
  if (!node.is_list()) {
    throw error(key, "found " + shown(node) + ", expected a list, each " + describe(dimension));
  }
  std::vector<double> values;
  for (const YamlNode& item : node.items()) values.push_back(convert(item, key, dimension));
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
  const YamlNode node = require(key);
  if (!node.is_list()) throw error(key, "found " + shown(node) + ", expected a list of texts");
  std::vector<std::string> values;
  for (const YamlNode& item : node.items()) {
    if (!item.is_text()) throw error(key, "found " + shown(item) + ", expected a text");
    values.push_back(item.text());
  }
  return values;
}

Config Config::section(const std::string& key) {
  const YamlNode node = require(key);
  if (!node.is_map()) throw error(key, "found " + shown(node) + ", expected a map of keys");
  return {node, file_, prefix_ + key + "."};
}

std::vector<Config> Config::sections(const std::string& key) {
  std::vector<Config> list;
  if (!has(key)) return list;
  const YamlNode node = raw(key);
  if (!node.is_list()) throw error(key, "found " + shown(node) + ", expected a list");
  for (std::size_t i = 0; i < node.size(); ++i) {
    const YamlNode& item = node.items()[i];
    if (!item.is_map()) throw error(key, "found " + shown(item) + ", expected a map of keys");
    list.push_back({item, file_, prefix_ + key + "[" + std::to_string(i) + "]."});
  }
  return list;
}

void Config::optional(const std::string& key, Dimension dimension, double& value) {
  if (known(key)) value = quantity(key, dimension);
}
void Config::optional(const std::string& key, int& value) {
  if (known(key)) value = small_integer(key);
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
    expect_present_name(key);
    const std::string nearest = nearest_word(key, {read_.begin(), read_.end()});
    throw error(
        key, "is not known here" + (!nearest.empty() ? "; did you mean '" + nearest + "'?" : ""));
  }
}

void Config::expect_present_name(const std::string& key) const {
  if (const auto now = present_name(prefix_ + key)) {
    throw error(
        key, "is called '" + *now + "' now: rename it, or 'berth config migrate' a whole folder");
  }
}

}  // namespace berth
