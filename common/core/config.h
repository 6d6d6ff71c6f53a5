// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/core/bounds.h"
#include "common/core/config_recorder.h"
#include "common/core/error.h"
#include "common/core/pose.h"
#include "common/core/quantity.h"
#include "common/core/yaml.h"

namespace berth {

/// Words of a choice, and what each means.
template <class T>
using Choices = std::initializer_list<std::pair<const char*, T>>;

/// Strict reading of YAML: every key must be known, every value of its type, unit and bounds. The
/// call that reads a key is its definition: error, description (`berth config describe`) and schema
/// come of it. All functions throw InputError of the form "file:line: key 'a.b': found ...,
/// expected ...".
///
///     Config config = Config::load("lidar.yaml");
///     Beam beam;
///     config.optional("rate", Dimension::frequency, beam.rate_hz, above(0));
///     config.finish();            // throws for any key that was not read
class Config {
 public:
  /// Reads a file, as read_yaml() does.
  static Config load(const std::filesystem::path& path);
  /// Reads text; name stands in for the file in messages.
  static Config parse(const std::string& text, const std::string& name);
  /// Of a node that was read already. @throws InputError unless it is a map.
  Config(const YamlNode& node, std::string file);
  /// The same place in the same file, holding another map.
  Config holding(const YamlNode& node) const;

  bool has(const std::string& key) const;
  /// All keys of this map, in the file's order.
  std::vector<std::string> keys() const;

  /// Required values: a missing key is an error. Bounds are of SI units.
  double quantity(const std::string& key, Dimension dimension, const ValueBounds& bounds = {});
  double number(const std::string& key, const ValueBounds& bounds = {}) {
    return quantity(key, Dimension::number, bounds);
  }
  /// A time in whole microseconds.
  std::int64_t microseconds(const std::string& key, const ValueBounds& bounds = {});
  /// In decimal digits (010 is ten), or as 0x1F, 0o17, 1e3.
  std::int64_t integer(const std::string& key, const ValueBounds& bounds = {});
  /// One that fits an int.
  int small_integer(const std::string& key, const ValueBounds& bounds = {});
  std::vector<std::int64_t> integers(const std::string& key);
  bool boolean(const std::string& key);
  std::string text(const std::string& key);
  /// One of the words given.
  std::string choice(const std::string& key, const std::vector<std::string>& words);
  /// The value that a word stands for: choice<Side>("on", {{"left", Side::left}, ...}).
  template <class T>
  T choice(const std::string& key, Choices<T> choices) {
    return meaning(choice(key, words_of(choices)), choices);
  }
  /// [x, y, z, w, p, r] in mm and degrees, as on the pendant.
  Pose pose(const std::string& key);
  /// Three quantities of one dimension.
  Vector3d vector(const std::string& key, Dimension dimension, const ValueBounds& bounds = {});
  std::vector<double> quantities(const std::string& key, Dimension dimension,
                                 const ValueBounds& bounds = {});
  std::vector<std::string> texts(const std::string& key);
  Config section(const std::string& key);
  /// An empty map when the key is missing.
  Config optional_section(const std::string& key);
  /// A list of maps; empty when the key is missing.
  std::vector<Config> sections(const std::string& key);
  /// Of a map whose keys are names of the user's own: the maps behind them, or the quantities.
  std::vector<std::pair<std::string, Config>> named_sections();
  std::map<std::string, double> named_quantities(Dimension dimension);
  /// The same of values with a grammar of their own, which `kind` names.
  std::vector<std::pair<std::string, YamlNode>> named_values(const std::string& kind);

  /// Optional values: the variable keeps its value, the default, when the key is missing.
  void optional(const std::string& key, Dimension dimension, double& value,
                const ValueBounds& bounds = {});
  void optional(const std::string& key, double& value, const ValueBounds& bounds = {}) {
    optional(key, Dimension::number, value, bounds);
  }
  void optional(const std::string& key, Dimension dimension, std::optional<double>& value,
                const ValueBounds& bounds = {});
  void optional(const std::string& key, Dimension dimension, std::optional<Vector3d>& value,
                const ValueBounds& bounds = {});
  void optional_microseconds(const std::string& key, std::int64_t& value,
                             const ValueBounds& bounds = {});
  void optional(const std::string& key, int& value, const ValueBounds& bounds = {});
  void optional(const std::string& key, std::int64_t& value, const ValueBounds& bounds = {});
  void optional(const std::string& key, bool& value);
  void optional(const std::string& key, std::string& value);
  /// A file or directory, as existing() finds it.
  void optional(const std::string& key, std::filesystem::path& value);
  void optional(const std::string& key, std::vector<std::string>& value);
  void optional(const std::string& key, Pose& value);
  void optional(const std::string& key, std::optional<Pose>& value);
  template <class T>
  void optional_choice(const std::string& key, T& value, std::type_identity_t<Choices<T>> choices) {
    std::string word;
    for (const auto& [name, means] : choices) {
      if (means == value) word = name;
    }
    word = optional_word(key, words_of(choices), word);
    if (!word.empty()) value = meaning(word, choices);
  }

  /// @throws InputError if this map has a key that was not read, with the nearest known key.
  void finish() const;

  /// An error that names this file, the line of the key and the key.
  InputError error(const std::string& key, const std::string& what) const;

  /// The file or directory at `path`, relative to this file's directory; absolute.
  /// @throws InputError of the key when nothing is there, or `path` is empty.
  std::filesystem::path existing(const std::string& key, const std::string& path) const;

  /// The keys that readers have requested so far, present or not.
  const std::set<std::string>& keys_read() const { return read_; }

  const std::string& file() const { return file_; }
  int line() const;
  /// The raw node, nothing where there is none, for readers with a grammar of their own, which
  /// `kind` names; marks the key as read.
  YamlNode raw(const std::string& key, const std::string& kind = "");
  const YamlNode& node() const { return node_; }

 private:
  using Key = ConfigKey;

  Config child(const YamlNode& node, const std::string& name, const std::string& recorded) const;
  void record(const std::string& key, Key defined);  // for the thread's recorder
  YamlNode require(const std::string& key);
  void expect_present_name(const std::string& key) const;  // @throws InputError for a former name
  bool known(const std::string& key);                      // marks an optional key as known
  double convert(const YamlNode& node, const std::string& key, Dimension dimension,
                 const ValueBounds& bounds) const;
  template <class Integer>
  Integer whole(const YamlNode& node, const std::string& key, const ValueBounds& bounds) const;
  Config read_section(const std::string& key);
  Vector3d read_vector(const std::string& key, Dimension dimension, const ValueBounds& bounds);
  bool read_boolean(const std::string& key);
  std::string read_text(const std::string& key);
  std::string read_word(const std::string& key, const std::vector<std::string>& words);
  std::vector<double> read_quantities(const std::string& key, Dimension dimension,
                                      const ValueBounds& bounds);
  Pose read_pose(const std::string& key);
  std::vector<std::string> read_texts(const std::string& key);
  template <class Integer>
  void optional_whole(const std::string& key, Integer& value, const ValueBounds& bounds);
  /// Empty when the key is missing.
  std::string optional_word(const std::string& key, const std::vector<std::string>& words,
                            const std::string& default_value);

  template <class T>
  static std::vector<std::string> words_of(Choices<T> choices) {
    std::vector<std::string> words;
    for (const auto& [word, means] : choices) words.emplace_back(word);
    return words;
  }
  template <class T>
  static T meaning(const std::string& word, Choices<T> choices) {
    const auto* found = choices.begin();
    while (word != found->first) ++found;
    return found->second;
  }

  YamlNode node_;
  std::string file_;
  std::string prefix_;  // "arms.replica."
  std::set<std::string> read_;
  ConfigRecorder* recorder_ = nullptr;
  std::string recorded_;  // as prefix_, without indices and the user's names
};

}  // namespace berth
