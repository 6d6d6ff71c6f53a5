// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "common/core/error.h"
#include "common/core/pose.h"
#include "common/core/quantity.h"
#include "common/core/yaml.h"

namespace berth {

/// Strict reading of YAML: every key must be known, every value of its type and unit. All functions
/// throw InputError of the form "file:line: key 'a.b': found ..., expected ...".
///
///     Config config = Config::load("lidar.yaml");
///     Beam beam;
///     config.optional("rate", Dimension::frequency, beam.rate_hz);
///     config.finish();            // complains of any key that nobody asked for
class Config {
 public:
  /// Reads a file, as read_yaml() does.
  static Config load(const std::filesystem::path& path);
  /// Reads text; name stands in for the file in messages.
  static Config parse(const std::string& text, const std::string& name);
  /// Of what was read already. @throws InputError unless it is a map.
  Config(const YamlNode& node, std::string file);
  /// The same place in the same file, holding another map.
  Config holding(const YamlNode& node) const;

  bool has(const std::string& key) const;
  /// All keys of this map, in the file's order.
  std::vector<std::string> keys() const;

  /// Required values: a missing key is an error.
  double quantity(const std::string& key, Dimension dimension);
  double number(const std::string& key) { return quantity(key, Dimension::number); }
  /// In decimal digits (010 is ten), or as 0x1F, 0o17, 1e3.
  std::int64_t integer(const std::string& key);
  /// One that fits an int.
  int small_integer(const std::string& key);
  std::vector<std::int64_t> integers(const std::string& key);
  bool boolean(const std::string& key);
  std::string text(const std::string& key);
  /// One of the words given.
  std::string choice(const std::string& key, const std::vector<std::string>& words);
  /// [x, y, z, w, p, r] in mm and degrees, as on the pendant.
  Pose pose(const std::string& key);
  /// Three quantities of one dimension.
  Vector3d vector(const std::string& key, Dimension dimension);
  std::vector<double> quantities(const std::string& key, Dimension dimension);
  std::vector<std::string> texts(const std::string& key);
  Config section(const std::string& key);
  /// A list of maps; empty when the key is missing.
  std::vector<Config> sections(const std::string& key);

  /// Optional values: the variable keeps its value when the key is missing.
  void optional(const std::string& key, Dimension dimension, double& value);
  void optional(const std::string& key, double& value) { optional(key, Dimension::number, value); }
  void optional(const std::string& key, int& value);
  void optional(const std::string& key, std::int64_t& value);
  void optional(const std::string& key, bool& value);
  void optional(const std::string& key, std::string& value);
  void optional(const std::string& key, Pose& value);

  /// @throws InputError if this map has a key that was not read, with the nearest known key.
  void finish() const;

  /// An error that names this file, the line of the key and the key.
  InputError error(const std::string& key, const std::string& what) const;

  /// The keys that readers asked for so far, whether there or not.
  const std::set<std::string>& asked() const { return read_; }

  const std::string& file() const { return file_; }
  int line() const;
  /// The raw node, nothing where there is none, for readers with a grammar of their own; marks the
  /// key as read.
  YamlNode raw(const std::string& key);
  const YamlNode& node() const { return node_; }

 private:
  Config(const YamlNode& node, std::string file, std::string prefix);
  YamlNode require(const std::string& key);
  void expect_present_name(const std::string& key) const;  // @throws InputError for one of before
  bool known(const std::string& key);  // marks an optional key as one that may be there
  double convert(const YamlNode& node, const std::string& key, Dimension dimension) const;
  std::int64_t whole(const YamlNode& node, const std::string& key, std::int64_t least,
                     std::int64_t most) const;

  YamlNode node_;
  std::string file_;
  std::string prefix_;  // "arms.replica."
  std::set<std::string> read_;
};

}  // namespace berth
