// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace berth {

/// A node of a YAML file: nothing, a text, a list or a map, and its line. A handle: a copy shares
/// its content.
class YamlNode {
 public:
  enum class Kind { nothing, text, list, map };
  using Entry = std::pair<YamlNode, YamlNode>;  ///< key (always a text) and value

  explicit YamlNode(Kind kind = Kind::nothing);
  explicit YamlNode(std::string text);

  Kind kind() const;
  bool is_nothing() const { return kind() == Kind::nothing; }
  bool is_text() const { return kind() == Kind::text; }
  bool is_list() const { return kind() == Kind::list; }
  bool is_map() const { return kind() == Kind::map; }

  /// Empty unless it is a text.
  const std::string& text() const;
  /// Empty unless it is a list.
  const std::vector<YamlNode>& items() const;
  /// In the file's order; empty unless it is a map.
  const std::vector<Entry>& entries() const;
  bool has(const std::string& key) const;
  /// Nothing when there is no such key.
  YamlNode at(const std::string& key) const;
  /// How many entries or items.
  std::size_t size() const;

  /// From 1.
  int line() const;
  /// Offset in clean_text() of the file.
  std::size_t offset() const;
  /// The same content at another place, all that it holds with it.
  YamlNode placed_at(const YamlNode& place) const;

  /// The very same content, shared.
  bool is(const YamlNode& other) const { return content_ == other.content_; }
  void add(YamlNode item);
  void add(YamlNode key, YamlNode value);
  /// Replaces the value of a key, or adds it at the end; all handles to this node see it.
  void put(const std::string& key, YamlNode value);
  void put(const std::string& key, const std::string& text) { put(key, YamlNode(text)); }

  /// Same content, on any line; maps in the same order.
  friend bool operator==(const YamlNode& a, const YamlNode& b);

 private:
  friend class YamlTree;
  struct Content;
  std::shared_ptr<Content> content_;
};

/// "a list of 2", "'5 m'": for messages.
std::string shown(const YamlNode& node);

/// More than any file of ours needs: the longest list of waypoints has a tenth of it.
inline constexpr std::size_t max_yaml_nodes = 100000;
inline constexpr int max_yaml_levels = 100;

/// The text as it is read: without a byte order mark at its start, each line ended by LF.
/// @throws InputError "name:line: ..." for bytes that are not UTF-8, and for control characters.
std::string clean_text(const std::string& bytes, const std::string& name);

/// Reads a text of YAML 1.2: one document, without tags; keys are texts, and none appears twice.
/// Aliases and merges (`<<`) are put in place: with them there may be `max_yaml_nodes` nodes in
/// `max_yaml_levels` levels.
/// @throws InputError "name:line: ..." for everything else.
YamlNode read_yaml(const std::string& bytes, const std::string& name);

/// All files *.yaml below a directory, in order of their names.
/// @throws std::filesystem::filesystem_error
std::vector<std::filesystem::path> yaml_files(const std::filesystem::path& directory);

}  // namespace berth
