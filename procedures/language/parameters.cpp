// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/parameters.h"

#include <algorithm>
#include <functional>
#include <set>

#include "common/core/error.h"
#include "common/core/text.h"
#include "common/core/yaml_text.h"

namespace berth::procedures {
namespace {

using Values = std::map<std::string, YamlNode>;

InputError wrong_at(const std::string& file, int line, const std::string& what) {
  return InputError(file + ":" + std::to_string(line) + ": " + what);
}

bool is_word_character(char c) {
  return c == '_' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/// Of a text: from `begin` to before `end`.
struct Reference {
  std::size_t begin;
  std::size_t end;
  std::string name;
};

/// The next `$<name>` at or behind `from`; with other brackets the next `${name}`.
std::optional<Reference> reference_in(const std::string& text, std::size_t from,
                                      const char* brackets = "<>") {
  const char start[] = {'$', brackets[0]};
  for (auto at = text.find(start, from, 2); at != std::string::npos;
       at = text.find(start, at + 1, 2)) {
    std::size_t end = at + 2;
    while (end < text.size() && is_word_character(text[end])) ++end;
    if (end == at + 2 || end == text.size() || text[end] != brackets[1]) continue;
    return Reference{at, end + 1, text.substr(at + 2, end - at - 2)};
  }
  return std::nullopt;
}

bool refers(const std::string& text) { return reference_in(text, 0).has_value(); }

/// The text with YAML-safe references of equal length, so that offsets are unchanged.
std::string with_references(std::string text) {
  for (auto found = reference_in(text, 0, "{}"); found;
       found = reference_in(text, found->end, "{}")) {
    text[found->begin + 1] = '<';
    text[found->end - 1] = '>';
  }
  return text;
}

using OnText = std::function<YamlNode(const YamlNode&)>;

/// The node with `made` applied to each text; keys are kept, unchanged nodes shared.
YamlNode with_texts(const YamlNode& node, const OnText& made) {
  if (node.is_text()) return made(node);
  YamlNode copy = YamlNode(node.kind()).placed_at(node);
  bool same = true;
  for (const YamlNode& item : node.items()) {
    copy.add(with_texts(item, made));
    same = same && copy.items().back().is(item);
  }
  for (const auto& [key, value] : node.entries()) {
    copy.add(key, with_texts(value, made));
    same = same && copy.entries().back().second.is(value);
  }
  return same ? node : copy;
}

/// Each top-level entry but the block of parameters.
YamlNode with_texts_of_procedure(const YamlNode& tree, const OnText& made) {
  YamlNode copy = YamlNode(YamlNode::Kind::map).placed_at(tree);
  for (const auto& [key, value] : tree.entries()) {
    const bool block = key.text() == "parameters";
    copy.add(key, block ? value : with_texts(value, made));
  }
  return copy;
}

YamlNode filled(const YamlNode& node, const Values& values) {
  const std::string& text = node.text();
  std::string result;
  std::size_t from = 0;
  for (auto found = reference_in(text, 0); found; found = reference_in(text, found->end)) {
    const auto value = values.find(found->name);
    if (value == values.end()) continue;
    if (found->begin == 0 && found->end == text.size()) return value->second.placed_at(node);
    result += text.substr(from, found->begin - from) + plain_text(value->second);
    from = found->end;
  }
  if (from == 0) return node;
  return YamlNode(result + text.substr(from)).placed_at(node);
}

std::vector<Parameter> read_block(const Written& written, const std::string& file) {
  const YamlNode block = written.tree.at("parameters");
  if (!block.is_map() && !block.is_nothing()) {
    throw wrong_at(
        file, block.line(),
        "key 'parameters': found " + shown(block) + ", expected one parameter per line below it");
  }
  std::vector<Parameter> parameters;
  for (const auto& [name, value] : block.entries()) {
    const bool list = value.is_list() && value.size() > 0;
    const bool good = list || (value.is_text() && !value.text().empty());
    const std::string shown_value = plain_text(value);
    const bool open =
        !written.as_run && (refers(shown_value) || shown_value.find("${") != std::string::npos);
    if (!is_name(name.text()) || !good || open) {
      throw wrong_at(file, name.line(),
                     "key 'parameters': found '" + name.text() + ": " + shown_value +
                         "', expected 'name: value'");
    }
    parameters.push_back({name, value, comment_behind(written.text, value)});
  }
  return parameters;
}

std::string known_names(const std::vector<Parameter>& parameters) {
  std::set<std::string> names;
  for (const Parameter& parameter : parameters) names.insert(parameter.name.text());
  return names.empty() ? "the procedure has none"
                       : "there are: " + joined({names.begin(), names.end()});
}

/// In a procedure as run, parameters are filled in and cannot be overridden.
void refuse_other_value(const YamlNode& value, const YamlNode& given, const std::string& file,
                        const std::string& name) {
  if (given == value) return;
  throw InputError(file + ": parameter '" + name +
                   "': this is a procedure as it was run, with its parameters filled in");
}

struct Names {
  const Written& written;
  const std::string& file;
  const Values& values;
  const std::set<std::string>& swept;
};

/// Adds the names that a node refers to. @throws InputError for an unknown name.
void add_used(const YamlNode& node, const Names& names, std::set<std::string>& used) {
  const auto use = [&](const std::string& name) {
    used.insert(name);
    if (names.values.count(name) != 0 || names.swept.count(name) != 0) return;
    throw wrong_at(
        names.file, node.line(),
        "parameter '" + name + "' is not defined; " + known_names(names.written.parameters));
  };
  const std::string& text = node.text();
  for (auto found = reference_in(text, 0); found; found = reference_in(text, found->end)) {
    use(found->name);
  }
  // A remaining reference contains no valid name.
  if (const auto open = text.find("${"); open != std::string::npos) {
    const auto end = text.find('}', open);
    if (end != std::string::npos) use(text.substr(open + 2, end - open - 2));
  }
  for (const YamlNode& item : node.items()) add_used(item, names, used);
  for (const auto& [key, value] : node.entries()) {
    if (refers(key.text())) {
      throw wrong_at(names.file, key.line(),
                     "key '" + key.text() + "': a key holds no reference, expected a word");
    }
    add_used(value, names, used);
  }
}

}  // namespace

bool is_name(const std::string& text) {
  return !text.empty() && !(text[0] >= '0' && text[0] <= '9') &&
         std::all_of(text.begin(), text.end(), is_word_character);
}

std::optional<Dimension> dimension_of(const std::string& value) {
  for (int d = 0; d <= static_cast<int>(Dimension::mass); ++d) {
    try {
      parse_quantity(value, static_cast<Dimension>(d));
      return static_cast<Dimension>(d);
    } catch (const InputError&) {
      continue;
    }
  }
  return std::nullopt;
}

YamlNode value_in_place_of(const YamlNode& before, const std::string& text,
                           const std::string& name) {
  const auto wrong = [&](const std::string& expected) {
    return InputError(name + ": found '" + text + "', expected " + expected);
  };
  if (before.is_list()) {
    YamlNode list;
    try {
      list = read_yaml(text, name);
    } catch (const InputError&) {
      throw wrong("a list such as '" + flow_text(before) + "'");
    }
    if (!list.is_list() || list.size() != before.size() || refers(flow_text(list))) {
      throw wrong("a list such as '" + flow_text(before) + "'");
    }
    return list;
  }
  if (text.empty() || refers(text)) throw wrong("one value such as '" + before.text() + "'");
  if (clean_text(text, name) != text) throw wrong("lines that end in LF, and no byte order mark");
  const auto dimension = dimension_of(before.text());
  try {
    if (dimension) parse_quantity(text, *dimension);
  } catch (const InputError& e) {
    throw InputError(name + ": " + e.what());
  }
  return YamlNode(text);
}

YamlNode fill(const YamlNode& node, const Values& values) {
  return with_texts(node, [&values](const YamlNode& text) { return filled(text, values); });
}

void refuse_open_references(const YamlNode& node, const std::string& file) {
  with_texts(node, [&file](const YamlNode& text) {
    if (const auto open = reference_in(text.text(), 0)) {
      throw wrong_at(file, text.line(),
                     "'" + open->name + "' has no value here: it belongs to a sweep elsewhere");
    }
    return text;
  });
}

Written read_written(const std::string& text, const std::string& file) {
  Written written;
  written.text = clean_text(text, file);
  if (written.text.empty() || written.text.back() != '\n') written.text += '\n';
  written.tree = read_yaml(with_references(written.text), file);
  if (!written.tree.is_map()) {
    throw wrong_at(file, written.tree.line(),
                   "found " + shown(written.tree) + ", expected a map of keys");
  }
  written.as_run = written.tree.at("as_run").text() == "true";
  // As run, "${" is part of a value.
  if (written.as_run) written.tree = read_yaml(written.text, file);
  written.parameters = read_block(written, file);
  return written;
}

Filled apply_parameters(const Written& written, const std::string& file, const Overrides& overrides,
                        const std::set<std::string>& swept) {
  Values values;
  std::vector<YamlEdit> edits;
  bool editable = true;
  const std::string places = with_references(written.text);
  const auto edit = [&](const YamlNode& before, const YamlNode& after) {
    const auto span = span_of(places, before);
    if (span) edits.push_back({*span, after});
    editable = editable && span;
  };
  YamlNode block = YamlNode(YamlNode::Kind::map).placed_at(written.tree.at("parameters"));
  auto given = overrides;
  for (const Parameter& parameter : written.parameters) {
    const std::string& name = parameter.name.text();
    YamlNode value = parameter.value;
    if (const auto found = given.find(name); found != given.end()) {
      value = value_in_place_of(value, found->second, "parameter '" + name + "'").placed_at(value);
      if (written.as_run) refuse_other_value(parameter.value, value, file, name);
      edit(parameter.value, value);
      given.erase(found);
    }
    values.emplace(name, value);
    block.add(parameter.name, value);
    if (swept.count(name) == 0) continue;
    throw wrong_at(file, parameter.name.line(),
                   "'" + name + "' is the name of a parameter and of a sweep, expected two names");
  }
  if (!given.empty()) {
    throw InputError(file + ": no parameter '" + given.begin()->first + "'; " +
                     known_names(written.parameters));
  }
  if (written.as_run) return {written.text, written.tree};

  std::set<std::string> used;
  for (const auto& [key, value] : written.tree.entries()) {
    if (key.text() != "parameters") add_used(value, {written, file, values, swept}, used);
  }
  for (const Parameter& parameter : written.parameters) {
    if (used.count(parameter.name.text()) != 0) continue;
    throw wrong_at(file, parameter.name.line(),
                   "key 'parameters." + parameter.name.text() + "': is never used");
  }
  Filled result;
  result.tree = with_texts_of_procedure(written.tree, [&](const YamlNode& node) {
    YamlNode made = filled(node, values);
    if (refers(node.text())) edit(node, made);
    return made;
  });
  if (!written.parameters.empty()) result.tree.put("parameters", block);
  std::optional<std::string> text;
  if (editable) text = edited(written.text, edits, result.tree);
  result.text = text ? *text : berth::written(result.tree);
  return result;
}

}  // namespace berth::procedures
