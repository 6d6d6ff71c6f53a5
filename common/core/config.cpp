// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/config.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "common/core/file.h"
#include "common/core/nearest_word.h"
#include "common/core/renamed_keys.h"
#include "common/core/text.h"
#include "common/core/yaml_text.h"

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
  constexpr auto max_value = std::uint64_t{1} << 63U;
  if (read.ec == std::errc() && read.ptr == end) {
    if (size > max_value || (size == max_value && !negative)) return std::nullopt;
    return static_cast<std::int64_t>(negative ? 0 - size : size);
  }
  constexpr double exact = 9007199254740992;  // doubles skip whole numbers above it
  double value = -1;
  const auto real = std::from_chars(digits.data(), end, value);
  const bool whole = real.ec == std::errc() && real.ptr == end && value == std::floor(value) &&
                     value >= 0 && value <= exact && base == 10;
  if (!whole) return std::nullopt;
  return static_cast<std::int64_t>(negative ? -value : value);
}

/// The bounds as text, to follow the quantity's name: " above 0", " of at least 1 mm".
std::string in_words(const ValueBounds& bounds, Dimension dimension) {
  const std::string text = text_of(bounds, dimension);
  return (text.rfind("at ", 0) == 0 ? " of " : " ") + text;
}

/// "a length".
std::string a_quantity(Dimension dimension) {
  const std::string text = describe(dimension);
  return text.substr(0, text.find(" such as"));
}

}  // namespace

Config::Config(const YamlNode& node, std::string file)
    : node_(node), file_(std::move(file)), recorder_(ConfigRecorder::current()) {
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

Config Config::child(const YamlNode& node, const std::string& name,
                     const std::string& recorded) const {
  Config config = *this;
  config.node_ = node;
  config.read_.clear();
  config.prefix_ += name;
  if (recorder_ != nullptr) config.recorded_ += recorded;
  return config;
}

Config Config::holding(const YamlNode& node) const { return child(node, "", ""); }

void Config::record(const std::string& key, Key defined) {
  defined.file = file_;
  defined.path = recorded_ + key;
  if (has(key) && defined.kind != Key::Kind::map && defined.kind != Key::Kind::maps) {
    defined.value = plain_text(node_.at(key));
  }
  recorder_->add(std::move(defined));
}

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

YamlNode Config::raw(const std::string& key, const std::string& kind) {
  if (recorder_ != nullptr && !kind.empty())
    record(key, {.kind = Key::Kind::other, .words = {kind}});
  read_.insert(key);
  return node_.at(key);
}

YamlNode Config::require(const std::string& key) {
  if (!known(key)) throw error(key, "is missing");
  return node_.at(key);
}

double Config::convert(const YamlNode& node, const std::string& key, Dimension dimension,
                       const ValueBounds& bounds) const {
  if (!node.is_text()) {
    throw error(key, "found " + shown(node) + ", expected " + describe(dimension));
  }
  try {
    const double value = parse_quantity(node.text(), dimension);
    if (bounds.contain(value)) return value;
  } catch (const InputError& e) {
    throw error(key, e.what());
  }
  throw error(key, "found " + shown(node) + ", expected " + a_quantity(dimension) +
                       in_words(bounds, dimension));
}

double Config::quantity(const std::string& key, Dimension dimension, const ValueBounds& bounds) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::quantity, .dimension = dimension, .bounds = bounds});
  }
  return convert(require(key), key, dimension, bounds);
}

std::int64_t Config::microseconds(const std::string& key, const ValueBounds& bounds) {
  return std::llround(1e6 * quantity(key, Dimension::time, bounds));
}

template <class Integer>
Integer Config::whole(const YamlNode& node, const std::string& key,
                      const ValueBounds& bounds) const {
  const auto value = node.is_text() ? whole_number(node.text()) : std::nullopt;
  if (!value) throw error(key, "found " + shown(node) + ", expected a whole number");
  if (!bounds.contain(static_cast<double>(*value))) {
    throw error(key, "found " + shown(node) + ", expected a whole number" +
                         in_words(bounds, Dimension::number));
  }
  if (std::in_range<Integer>(*value)) return static_cast<Integer>(*value);
  using Limits = std::numeric_limits<Integer>;
  throw error(key, "found " + shown(node) + ", expected a whole number from " +
                       std::to_string(Limits::min()) + " to " + std::to_string(Limits::max()));
}

std::int64_t Config::integer(const std::string& key, const ValueBounds& bounds) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::integer, .bounds = bounds});
  return whole<std::int64_t>(require(key), key, bounds);
}

int Config::small_integer(const std::string& key, const ValueBounds& bounds) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::integer, .bounds = bounds});
  return whole<int>(require(key), key, bounds);
}

std::vector<std::int64_t> Config::integers(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::integers});
  const YamlNode node = require(key);
  if (!node.is_list()) throw error(key, "found " + shown(node) + ", expected a list");
  std::vector<std::int64_t> values;
  for (const YamlNode& item : node.items()) {
    values.push_back(whole<std::int64_t>(item, key, {}));
  }
  return values;
}

bool Config::read_boolean(const std::string& key) {
  const YamlNode node = require(key);
  if (node.is_text() && node.text() == "true") return true;
  if (node.is_text() && node.text() == "false") return false;
  throw error(key, "found " + shown(node) + ", expected true or false");
}

bool Config::boolean(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::boolean});
  return read_boolean(key);
}

std::string Config::read_text(const std::string& key) {
  const YamlNode node = require(key);
  if (!node.is_text()) throw error(key, "found " + shown(node) + ", expected a text");
  return node.text();
}

std::string Config::text(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::text});
  return read_text(key);
}

std::string Config::read_word(const std::string& key, const std::vector<std::string>& words) {
  const std::string found = read_text(key);
  if (std::find(words.begin(), words.end(), found) != words.end()) return found;
  throw error(key, "found '" + found + "', expected one of: " + joined(words));
}

std::string Config::choice(const std::string& key, const std::vector<std::string>& words) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::choice, .words = words});
  return read_word(key, words);
}

std::string Config::optional_word(const std::string& key, const std::vector<std::string>& words,
                                  const std::string& default_value) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::choice,
                 .words = words,
                 .required = false,
                 .default_value = default_value});
  }
  return known(key) ? read_word(key, words) : "";
}

std::vector<double> Config::read_quantities(const std::string& key, Dimension dimension,
                                            const ValueBounds& bounds) {
  const YamlNode node = require(key);
  if (!node.is_list()) {
    throw error(key, "found " + shown(node) + ", expected a list, each " + describe(dimension));
  }
  std::vector<double> values;
  for (const YamlNode& item : node.items()) {
    values.push_back(convert(item, key, dimension, bounds));
  }
  return values;
}

std::vector<double> Config::quantities(const std::string& key, Dimension dimension,
                                       const ValueBounds& bounds) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::quantities, .dimension = dimension, .bounds = bounds});
  }
  return read_quantities(key, dimension, bounds);
}

Pose Config::read_pose(const std::string& key) {
  const auto values = read_quantities(key, Dimension::number, {});
  if (values.size() != 6) {
    throw error(key, "found a list of " + std::to_string(values.size()) +
                         ", expected [x, y, z, w, p, r] in mm and degrees");
  }
  Xyzwpr xyzwpr;
  std::copy(values.begin(), values.end(), xyzwpr.begin());
  return pose_from_xyzwpr(xyzwpr);
}

Pose Config::pose(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::pose});
  return read_pose(key);
}

Vector3d Config::read_vector(const std::string& key, Dimension dimension,
                             const ValueBounds& bounds) {
  const auto values = read_quantities(key, dimension, bounds);
  if (values.size() != 3) {
    throw error(key, "found a list of " + std::to_string(values.size()) +
                         ", expected three values, each " + describe(dimension));
  }
  return {values[0], values[1], values[2]};
}

Vector3d Config::vector(const std::string& key, Dimension dimension, const ValueBounds& bounds) {
  if (recorder_ != nullptr) {
    record(key,
           {.kind = Key::Kind::quantities, .dimension = dimension, .size = 3, .bounds = bounds});
  }
  return read_vector(key, dimension, bounds);
}

std::vector<std::string> Config::read_texts(const std::string& key) {
  const YamlNode node = require(key);
  if (!node.is_list()) throw error(key, "found " + shown(node) + ", expected a list of texts");
  std::vector<std::string> values;
  for (const YamlNode& item : node.items()) {
    if (!item.is_text()) throw error(key, "found " + shown(item) + ", expected a text");
    values.push_back(item.text());
  }
  return values;
}

std::vector<std::string> Config::texts(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::texts});
  return read_texts(key);
}

Config Config::section(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::map});
  return read_section(key);
}

Config Config::read_section(const std::string& key) {
  const YamlNode node = require(key);
  if (!node.is_map()) throw error(key, "found " + shown(node) + ", expected a map of keys");
  return child(node, key + ".", key + ".");
}

Config Config::optional_section(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::map, .required = false});
  if (known(key)) return read_section(key);
  return child(YamlNode(YamlNode::Kind::map).placed_at(node_), key + ".", key + ".");
}

std::vector<Config> Config::sections(const std::string& key) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::maps, .required = false});
  std::vector<Config> list;
  if (!has(key)) return list;
  const YamlNode node = raw(key);
  if (!node.is_list()) throw error(key, "found " + shown(node) + ", expected a list");
  for (std::size_t i = 0; i < node.size(); ++i) {
    const YamlNode& item = node.items()[i];
    if (!item.is_map()) throw error(key, "found " + shown(item) + ", expected a map of keys");
    list.push_back(child(item, key + "[" + std::to_string(i) + "].", key + "[]."));
  }
  return list;
}

std::vector<std::pair<std::string, Config>> Config::named_sections() {
  if (recorder_ != nullptr) record("NAME", {.kind = Key::Kind::map, .required = false});
  std::vector<std::pair<std::string, Config>> all;
  for (const std::string& name : keys()) {
    const YamlNode node = raw(name);
    if (!node.is_map()) throw error(name, "found " + shown(node) + ", expected a map of keys");
    all.emplace_back(name, child(node, name + ".", "NAME."));
  }
  return all;
}

std::map<std::string, double> Config::named_quantities(Dimension dimension) {
  if (recorder_ != nullptr) {
    record("NAME", {.kind = Key::Kind::quantity, .dimension = dimension, .required = false});
  }
  std::map<std::string, double> values;
  for (const std::string& name : keys()) values[name] = convert(raw(name), name, dimension, {});
  return values;
}

std::vector<std::pair<std::string, YamlNode>> Config::named_values(const std::string& kind) {
  if (recorder_ != nullptr) {
    record("NAME", {.kind = Key::Kind::other, .words = {kind}, .required = false});
  }
  std::vector<std::pair<std::string, YamlNode>> values;
  for (const std::string& name : keys()) values.emplace_back(name, raw(name));
  return values;
}

std::filesystem::path Config::existing(const std::string& key, const std::string& path) const {
  if (path.empty()) throw error(key, "found '', expected a file or directory");
  const std::filesystem::path full =
      std::filesystem::absolute(std::filesystem::path(file_).parent_path() / path)
          .lexically_normal();
  if (!std::filesystem::exists(full)) {
    throw error(key,
                "found '" + path + "', expected a file or directory; there is no " + full.string());
  }
  return full;
}

void Config::optional(const std::string& key, Dimension dimension, double& value,
                      const ValueBounds& bounds) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::quantity,
                 .dimension = dimension,
                 .bounds = bounds,
                 .required = false,
                 .default_value = std::isfinite(value) ? text_of(value, dimension) : ""});
  }
  if (known(key)) value = convert(node_.at(key), key, dimension, bounds);
}

void Config::optional(const std::string& key, Dimension dimension, std::optional<double>& value,
                      const ValueBounds& bounds) {
  if (recorder_ != nullptr) {
    record(
        key,
        {.kind = Key::Kind::quantity, .dimension = dimension, .bounds = bounds, .required = false});
  }
  if (known(key)) value = convert(node_.at(key), key, dimension, bounds);
}

void Config::optional(const std::string& key, Dimension dimension, std::optional<Vector3d>& value,
                      const ValueBounds& bounds) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::quantities,
                 .dimension = dimension,
                 .size = 3,
                 .bounds = bounds,
                 .required = false});
  }
  if (known(key)) value = read_vector(key, dimension, bounds);
}

void Config::optional_microseconds(const std::string& key, std::int64_t& value,
                                   const ValueBounds& bounds) {
  double time = static_cast<double>(value) * 1e-6;
  optional(key, Dimension::time, time, bounds);
  if (has(key)) value = std::llround(1e6 * time);
}

template <class Integer>
void Config::optional_whole(const std::string& key, Integer& value, const ValueBounds& bounds) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::integer,
                 .bounds = bounds,
                 .required = false,
                 .default_value = std::to_string(value)});
  }
  if (known(key)) value = whole<Integer>(node_.at(key), key, bounds);
}

void Config::optional(const std::string& key, int& value, const ValueBounds& bounds) {
  optional_whole(key, value, bounds);
}

void Config::optional(const std::string& key, std::int64_t& value, const ValueBounds& bounds) {
  optional_whole(key, value, bounds);
}

void Config::optional(const std::string& key, bool& value) {
  if (recorder_ != nullptr) {
    record(
        key,
        {.kind = Key::Kind::boolean, .required = false, .default_value = value ? "true" : "false"});
  }
  if (known(key)) value = read_boolean(key);
}

void Config::optional(const std::string& key, std::string& value) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::text, .required = false, .default_value = value});
  }
  if (known(key)) value = read_text(key);
}

void Config::optional(const std::string& key, std::filesystem::path& value) {
  std::string text;
  optional(key, text);
  if (has(key)) value = existing(key, text);
}

void Config::optional(const std::string& key, std::vector<std::string>& value) {
  if (recorder_ != nullptr) {
    record(key, {.kind = Key::Kind::texts,
                 .required = false,
                 .default_value = value.empty() ? "" : "[" + joined(value) + "]"});
  }
  if (known(key)) value = read_texts(key);
}

void Config::optional(const std::string& key, Pose& value) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::pose, .required = false});
  if (known(key)) value = read_pose(key);
}

void Config::optional(const std::string& key, std::optional<Pose>& value) {
  if (recorder_ != nullptr) record(key, {.kind = Key::Kind::pose, .required = false});
  if (known(key)) value = read_pose(key);
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
