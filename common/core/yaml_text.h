// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/yaml.h"

namespace berth {

/// On one line, as YAML that reads as this node: `3 m`, `[1, 2, 3]`, `{a: "b: c"}`.
std::string flow_text(const YamlNode& node);

/// For operators: a text without quotes, a list as by flow_text.
std::string plain_text(const YamlNode& node);

/// A text between double quotes, with escapes.
std::string quoted(const std::string& text);

/// A file that reads as this map.
std::string written(const YamlNode& map);

/// Where a text has a value: from `begin` to before `end`.
struct YamlSpan {
  std::size_t begin = 0;
  std::size_t end = 0;
};

/// Of a text, or a list in brackets, in the text that it was read from; nothing where that is not
/// found.
std::optional<YamlSpan> span_of(const std::string& text, const YamlNode& node);

struct YamlEdit {
  YamlSpan span;
  YamlNode value;
};

/// The text with other values; comments and quotes are kept. Nothing where the result would not
/// read as `expected`.
std::optional<std::string> edited(const std::string& text, const std::vector<YamlEdit>& edits,
                                  const YamlNode& expected);

/// The comment behind a value, without its `#`; empty when its line has none.
std::string comment_behind(const std::string& text, const YamlNode& value);

}  // namespace berth
