// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/parameters.h"

#include <algorithm>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <vector>

#include "common/core/error.h"
#include "common/core/quantity.h"

namespace berth::procedures {
namespace {

using Lines = std::vector<std::string>;

struct Parameter {
  std::string value;
  std::size_t line = 0;  // index
  bool used = false;
};

InputError error_at(const std::string& file, std::size_t line, const std::string& what) {
  return InputError(file + ":" + std::to_string(line + 1) + ": " + what);
}

Lines lines_of(const std::string& text) {
  Lines lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// Where the comment of a line begins; its size when it has none.
std::size_t comment_start(const std::string& line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) {
      return i;
    }
  }
  return line.size();
}

/// The quantity's dimension; nothing for text and lists.
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

bool is_list(const std::string& value) {
  return value.size() >= 2 && value.front() == '[' && value.back() == ']';
}

void check_override(const std::string& name, const std::string& value,
                    const std::string& standard) {
  const std::string found = "parameter '" + name + "': found '" + value + "', expected ";
  if (value.empty() || value.find_first_of("\n\"'#{}") != std::string::npos ||
      value.find(": ") != std::string::npos) {
    throw InputError(found + "plain text");
  }
  if (is_list(standard)) {
    const auto commas = [](const std::string& s) { return std::count(s.begin(), s.end(), ','); };
    if (!is_list(value) || commas(value) != commas(standard)) {
      throw InputError(found + "a list such as '" + standard + "'");
    }
  } else if (const auto dimension = dimension_of(standard)) {
    try {
      parse_quantity(value, *dimension);
    } catch (const InputError& e) {
      throw InputError("parameter '" + name + "': " + e.what());
    }
  }
}

std::string names_of(const std::map<std::string, Parameter>& parameters) {
  std::string names;
  for (const auto& [name, parameter] : parameters) names += (names.empty() ? "" : ", ") + name;
  return names.empty() ? "the procedure has none" : "there are: " + names;
}

/// Reads the block `parameters` and writes the overrides into it.
std::map<std::string, Parameter> read_block(Lines& lines, const std::string& file,
                                            Overrides overrides) {
  std::map<std::string, Parameter> parameters;
  static const std::regex entry(R"(^(\s+)([A-Za-z_][A-Za-z0-9_]*):\s+(\S.*?)\s*$)");
  bool inside = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t comment_at = comment_start(lines[i]);
    const std::string content = lines[i].substr(0, comment_at);
    if (content.find_first_not_of(" \t\r") == std::string::npos) continue;
    if (content.front() != ' ') {
      inside = content.rfind("parameters:", 0) == 0;
      if (inside && content.find_first_not_of(" \t\r", 11) != std::string::npos) {
        throw error_at(file, i, "key 'parameters': expected one parameter per line below it");
      }
      continue;
    }
    if (!inside) continue;
    std::smatch match;
    if (!std::regex_match(content, match, entry) ||
        match[3].str().find("${") != std::string::npos) {
      throw error_at(file, i, "key 'parameters': found '" + content + "', expected 'name: value'");
    }
    const std::string name = match[2];
    std::string value = match[3];
    if (parameters.count(name) != 0) {
      throw error_at(file, i, "key 'parameters." + name + "' appears twice");
    }
    if (const auto given = overrides.find(name); given != overrides.end()) {
      check_override(name, given->second, value);
      value = given->second;
      const std::string comment = lines[i].substr(comment_at);
      lines[i] = match[1].str() + name + ": " + value + (comment.empty() ? "" : "  " + comment);
      overrides.erase(given);
    }
    parameters[name] = {value, i, false};
  }
  if (!overrides.empty()) {
    throw InputError(file + ": no parameter '" + overrides.begin()->first + "'; " +
                     names_of(parameters));
  }
  return parameters;
}

}  // namespace

std::string apply_parameters(const std::string& text, const std::string& file,
                             const Overrides& overrides) {
  Lines lines = lines_of(text);
  auto parameters = read_block(lines, file, overrides);
  static const std::regex reference(R"(\$\{([^}]*)\})");
  std::string result;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t comment_at = comment_start(lines[i]);
    std::string content = lines[i].substr(0, comment_at);
    std::smatch match;
    while (std::regex_search(content, match, reference)) {
      const auto found = parameters.find(match[1]);
      if (found == parameters.end()) {
        throw error_at(
            file, i, "parameter '" + match[1].str() + "' is not defined; " + names_of(parameters));
      }
      found->second.used = true;
      content = match.prefix().str() + found->second.value + match.suffix().str();
    }
    result += content + lines[i].substr(comment_at) + "\n";
  }
  for (const auto& [name, parameter] : parameters) {
    if (!parameter.used) {
      throw error_at(file, parameter.line, "key 'parameters." + name + "': is never used");
    }
  }
  return result;
}

}  // namespace berth::procedures
