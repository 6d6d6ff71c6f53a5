// SPDX-License-Identifier: BSD-3-Clause
#include "app/configuration/described_keys.h"

#include <algorithm>
#include <map>
#include <set>

#include "app/configuration/comments.h"
#include "common/core/file.h"
#include "common/core/text.h"

namespace berth {
namespace {

namespace fs = std::filesystem;
using Kind = ConfigKey::Kind;

/// Without its last name: "arms.joints[]" of "arms.joints[].low".
std::string parent_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}

/// The key whose map or list it is in.
std::string owner_of(const std::string& path) {
  const std::string parent = parent_of(path);
  const bool item = parent.size() > 2 && parent.substr(parent.size() - 2) == "[]";
  return item ? parent.substr(0, parent.size() - 2) : parent;
}

std::string last_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? path : path.substr(dot + 1);
}

/// The keys that a reader requests of one file, each once.
std::vector<ConfigKey> keys_of(const ConfigKind& kind, const fs::path& file) {
  const ConfigRecorder recorder;
  kind.read(file);
  std::map<std::string, bool> is_this;  // by name of a file
  std::vector<ConfigKey> keys;
  std::map<std::string, std::size_t> place;
  for (const ConfigKey& key : recorder.keys()) {
    auto [of, unknown] = is_this.try_emplace(key.file, false);
    if (unknown) {
      std::error_code error;
      of->second = fs::equivalent(key.file, file, error);
    }
    if (!of->second) continue;
    const auto [at, first] = place.try_emplace(key.path, keys.size());
    if (first) {
      keys.push_back(key);
    } else {
      ConfigKey& known = keys[at->second];
      known.required = known.required && key.required;
      if (known.value.empty()) known.value = key.value;
    }
  }
  return keys;
}

bool matches(const std::string& pattern, const std::string& path) {
  const std::string inner = parent_of(pattern);
  if (inner.empty() != parent_of(path).empty()) return false;
  const std::string name = last_of(pattern);
  if (name != "NAME" && name != last_of(path)) return false;
  return inner.empty() || matches(inner, parent_of(path));
}

/// Keys next to those of their section, sections in the order in which they were read.
void by_section(const std::string& section, const std::vector<DescribedKey>& all,
                std::vector<DescribedKey>& sorted) {
  for (const DescribedKey& one : all) {
    if (owner_of(one.key.path) != section) continue;
    sorted.push_back(one);
    if (one.key.kind == Kind::map || one.key.kind == Kind::maps) {
      by_section(one.key.path, all, sorted);
    }
  }
}

std::string kind_text(const ConfigKey& key) {
  switch (key.kind) {
    case Kind::quantity:
      return name_of(key.dimension);
    case Kind::quantities:
      return (key.size > 0 ? std::to_string(key.size) : "list of") + " " + name_of(key.dimension) +
             "s";
    case Kind::integer:
      return "whole number";
    case Kind::integers:
      return "list of whole numbers";
    case Kind::boolean:
      return "true or false";
    case Kind::text:
      return "text";
    case Kind::texts:
      return "list of texts";
    case Kind::choice:
      return "word";
    case Kind::pose:
      return "pose";
    case Kind::map:
      return "section";
    case Kind::maps:
      return "list of sections";
    case Kind::other:
      return key.words.front();
  }
  return {};
}

}  // namespace

std::vector<DescribedKey> described_keys(const ConfigKind& kind, const fs::path& file) {
  std::vector<fs::path> files = shipped_files(kind);
  if (!file.empty()) files.push_back(file);
  std::vector<DescribedKey> all;
  std::map<std::string, std::size_t> place;
  std::vector<std::set<std::string>> paths_read;  // of each file
  std::vector<std::map<std::string, std::string>> comments;
  for (const fs::path& one : files) {
    std::set<std::string> paths;
    const bool own = !file.empty() && &one == &files.back();
    for (ConfigKey& key : keys_of(kind, one)) {
      paths.insert(key.path);
      if (!own) key.value.clear();
      const auto [at, first] = place.try_emplace(key.path, all.size());
      if (first) {
        all.push_back({std::move(key), ""});
        continue;
      }
      ConfigKey& known = all[at->second].key;
      known.required = known.required && key.required;
      if (own) known.value = key.value;
    }
    paths_read.push_back(std::move(paths));
    comments.push_back(comments_of_keys(read_file(one)));
  }
  for (DescribedKey& one : all) {
    const std::string parent = parent_of(one.key.path);
    for (const auto& paths : paths_read) {
      const bool reached = std::any_of(paths.begin(), paths.end(), [&](const std::string& path) {
        return parent_of(path) == parent;
      });
      if (reached && paths.count(one.key.path) == 0) one.key.required = false;
    }
    if (last_of(one.key.path) == "NAME") {  // what each key means, its section's comment explains
      if (one.key.kind == Kind::map) continue;
      if (one.key.kind == Kind::other) {
        one.meaning = all[place.at(parent)].meaning;
        continue;
      }
    }
    for (const auto& of_file : comments) {
      for (const auto& [path, comment] : of_file) {
        if (one.meaning.empty() && matches(one.key.path, path)) one.meaning = comment;
      }
    }
  }
  // Of two sections alike one is commented: one has all keys of the other, the required ones if
  // any.
  std::map<std::string, std::set<std::string>> names;
  std::map<std::string, std::set<std::string>> required;
  for (const DescribedKey& one : all) {
    names[parent_of(one.key.path)].insert(last_of(one.key.path));
    if (one.key.required) required[parent_of(one.key.path)].insert(last_of(one.key.path));
  }
  const auto keys_in = [&](const std::string& section) -> const std::set<std::string>& {
    return required[section].empty() ? names[section] : required[section];
  };
  const auto has_all = [](const std::set<std::string>& a, const std::set<std::string>& b) {
    return std::includes(a.begin(), a.end(), b.begin(), b.end());
  };
  for (DescribedKey& one : all) {
    for (const DescribedKey& other : all) {
      if (!one.meaning.empty()) break;
      const auto& here = keys_in(parent_of(one.key.path));
      const auto& there = keys_in(parent_of(other.key.path));
      if (last_of(other.key.path) == last_of(one.key.path) && other.key.kind == one.key.kind &&
          (has_all(here, there) || has_all(there, here))) {
        one.meaning = other.meaning;
      }
    }
  }
  std::vector<DescribedKey> sorted;
  by_section("", all, sorted);
  return sorted;
}

Table key_table(const std::vector<DescribedKey>& keys, bool with_values) {
  Table table{"lllll", {"key", keyed("unit or kind", "kind"), "default", "allowed", "meaning"}};
  if (with_values) {
    table.alignment += "l";
    table.head.insert(table.head.begin() + 1, keyed("here", "value"));
  }
  for (const auto& [key, meaning] : keys) {
    std::string default_value = key.default_value.empty() ? "-" : key.default_value;
    if (key.required) default_value = "required";
    const bool words = key.kind == Kind::choice;
    std::vector<Table::Cell> row = {key.path, kind_text(key), default_value,
                                    words ? joined(key.words) : text_of(key.bounds, key.dimension),
                                    meaning};
    if (with_values) row.insert(row.begin() + 1, key.value);
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string document_of_keys() {
  std::string text;
  for (const ConfigKind& kind : config_kinds()) {
    Table table = key_table(described_keys(kind), false);
    for (auto& row : table.rows) row.cells[0] = "`" + row.cells[0].text + "`";
    text += "## `" + kind.files + "`\n\nKind `" + kind.name + "`: " + kind.what + ".\n\n" +
            markdown_table(table) + "\n";
  }
  text.pop_back();
  return text;
}

}  // namespace berth
