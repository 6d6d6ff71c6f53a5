// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/yaml_text.h"

#include <algorithm>
#include <cstdio>
#include <map>

#include "common/core/error.h"

namespace berth {
namespace {

/// A text that needs no quotes, in a list in brackets and out of it.
bool is_plain(const std::string& text) {
  // A merge key; document marks at a line's start; characters with a meaning to other YAML readers.
  const std::string start = text.substr(0, 3);
  if (text == "<<" || start == "---" || start == "...") return false;
  if (text.empty() || std::string("@`%").find(text[0]) != std::string::npos) return false;
  try {
    const YamlNode both = read_yaml("- " + text + "\n- [" + text + "]\n", "");
    return both.size() == 2 && both.items()[0] == YamlNode(text) && both.items()[1].size() == 1 &&
           both.items()[1].items()[0] == YamlNode(text);
  } catch (const InputError&) {
    return false;
  }
}

std::string token_of(const std::string& text) { return is_plain(text) ? text : quoted(text); }

void write_block(const YamlNode& node, const std::string& indent, std::string& out);

/// Behind "key:" or "-".
void write_value(const YamlNode& value, const std::string& indent, std::string& out) {
  const auto is_map = [](const YamlNode& item) { return item.is_map(); };
  const bool block =
      value.size() > 0 &&
      (value.is_map() || std::any_of(value.items().begin(), value.items().end(), is_map));
  if (block) {
    out += "\n";
    write_block(value, indent + "  ", out);
  } else {
    out += " " + flow_text(value) + "\n";
  }
}

void write_block(const YamlNode& node, const std::string& indent, std::string& out) {
  for (const auto& [key, value] : node.entries()) {
    out += indent + token_of(key.text()) + ":";
    write_value(value, indent, out);
  }
  for (const YamlNode& item : node.items()) {
    out += indent + "-";
    write_value(item, indent, out);
  }
}

constexpr auto none = std::string::npos;

std::size_t end_of_quotes(const std::string& text, std::size_t begin) {
  const char quote = text[begin];
  for (std::size_t i = begin + 1; i < text.size(); ++i) {
    if (quote == '"' && text[i] == '\\') {
      ++i;
    } else if (text[i] == quote) {
      if (quote == '"' || i + 1 == text.size() || text[i + 1] != '\'') return i + 1;
      ++i;
    }
  }
  return none;
}

/// A list in brackets.
std::size_t end_of_brackets(const std::string& text, std::size_t begin) {
  int depth = 0;
  for (std::size_t i = begin; i < text.size(); ++i) {
    if (text[i] == '"' || text[i] == '\'') {
      i = end_of_quotes(text, i);
      if (i == none) return none;
      --i;
    } else if (text[i] == '#' &&
               (text[i - 1] == ' ' || text[i - 1] == '\t' || text[i - 1] == '\n')) {
      i = text.find('\n', i);
      if (i == none) return none;
    } else if (text[i] == '[' || text[i] == '{') {
      ++depth;
    } else if ((text[i] == ']' || text[i] == '}') && --depth == 0) {
      return i + 1;
    }
  }
  return none;
}

/// A text after `|` or `>`: the lines below that are as far to the right as the first.
std::size_t end_of_block(const std::string& text, std::size_t begin) {
  std::size_t end = text.find('\n', begin);
  std::size_t indent = 0;
  for (std::size_t line = end; line != none && line + 1 < text.size();
       line = text.find('\n', line)) {
    const std::size_t first = text.find_first_not_of(' ', ++line);
    if (first == none || text[first] == '\n') continue;
    if (indent == 0) indent = first - line;
    if (indent == 0 || first - line < indent) break;
    end = text.find('\n', first);
  }
  return end;
}

/// A text without quotes, which may go on over several lines.
std::size_t end_of_plain(const std::string& text, std::size_t begin, const std::string& value) {
  std::size_t at = begin;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::size_t next = at < text.size() ? text.find_first_not_of(" \t\n", at) : none;
    if (next != none && next != at && text.find('\n', at) < next) {
      i = value.find_first_not_of(" \n", i);
      at = next;
    }
    if (i == none || at >= text.size() || text[at] != value[i]) return none;
    ++at;
  }
  return at;
}

/// The new value in the quotes of the old one, where these will do.
std::string in_place_of(const std::string& before, const YamlNode& after) {
  if (!after.is_text()) return flow_text(after);
  const std::string& text = after.text();
  const char quote = before[0];
  if (quote != '"' && quote != '\'') return token_of(text);
  const bool simple = std::none_of(text.begin(), text.end(), [quote](char c) {
    return c == quote || c == '\\' || static_cast<unsigned char>(c) < ' ';
  });
  return simple ? quote + text + quote : quoted(text);
}

}  // namespace

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += std::string("\\") + c;
    } else if (c == '\n') {
      out += "\\n";
    } else if (static_cast<unsigned char>(c) < ' ') {
      char escape[8];
      std::snprintf(escape, sizeof escape, "\\x%02X", static_cast<unsigned>(c));
      out += escape;
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string flow_text(const YamlNode& node) {
  std::string text;
  for (const YamlNode& item : node.items()) text += (text.empty() ? "" : ", ") + flow_text(item);
  for (const auto& [key, value] : node.entries()) {
    text += (text.empty() ? "" : ", ") + token_of(key.text()) + ": " + flow_text(value);
  }
  switch (node.kind()) {
    case YamlNode::Kind::text:
      return token_of(node.text());
    case YamlNode::Kind::list:
      return "[" + text + "]";
    case YamlNode::Kind::map:
      return "{" + text + "}";
    default:
      return "~";
  }
}

std::string plain_text(const YamlNode& node) {
  return node.is_text() ? node.text() : node.is_nothing() ? "" : flow_text(node);
}

std::string written(const YamlNode& map) {
  std::string out;
  write_block(map, "", out);
  return out;
}

std::optional<YamlSpan> span_of(const std::string& text, const YamlNode& node) {
  std::size_t begin = node.offset();
  if (begin < text.size() && text[begin] == '&') {
    begin = text.find_first_not_of(" \n", text.find_first_of(" \n", begin));
  }
  if (begin >= text.size()) return std::nullopt;
  std::size_t end = none;
  const char first = text[begin];
  if (!node.is_text()) {
    if (node.is_list() && first == '[') end = end_of_brackets(text, begin);
  } else if (first == '"' || first == '\'') {
    end = end_of_quotes(text, begin);
  } else if (first == '|' || first == '>') {
    end = end_of_block(text, begin);
  } else {
    end = end_of_plain(text, begin, node.text());
  }
  if (end == none) return std::nullopt;
  return YamlSpan{begin, end};
}

std::optional<std::string> edited(const std::string& text, const std::vector<YamlEdit>& edits,
                                  const YamlNode& expected) {
  std::map<std::size_t, const YamlEdit*> by_place;  // a value with several aliases is listed once
  for (const YamlEdit& edit : edits) by_place[edit.span.begin] = &edit;
  std::string result;
  std::size_t from = 0;
  for (const auto& [begin, edit] : by_place) {
    if (begin < from) return std::nullopt;
    const std::string before = text.substr(begin, edit->span.end - begin);
    result += text.substr(from, begin - from) + in_place_of(before, edit->value);
    from = edit->span.end;
  }
  result += text.substr(from);
  try {
    if (read_yaml(result, "") == expected) return result;
  } catch (const InputError&) {
    return std::nullopt;
  }
  return std::nullopt;
}

std::string comment_behind(const std::string& text, const YamlNode& value) {
  const auto span = span_of(text, value);
  if (!span) return {};
  const std::size_t first = text.find_first_not_of(" \t,", span->end);
  if (first == none || text[first] != '#') return {};
  const std::size_t end = std::min(text.find('\n', first), text.size());
  const std::size_t begin = text.find_first_not_of("# \t", first);
  if (begin >= end) return {};
  return text.substr(begin, text.find_last_not_of(" \t", end - 1) + 1 - begin);
}

}  // namespace berth
