// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/parameters.h"

#include <algorithm>
#include <regex>
#include <sstream>

#include "common/core/error.h"
#include "common/core/text.h"

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
  std::vector<std::string> names;
  for (const auto& [name, parameter] : parameters) names.push_back(name);
  return known_names(names);
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

/// As run: the parameters are filled in, and cannot be chosen again.
void refuse_other_values(const std::map<std::string, Parameter>& parameters,
                         const std::string& file, const Overrides& overrides) {
  for (const auto& [name, value] : overrides) {
    const auto found = parameters.find(name);
    if (found != parameters.end() && found->second.value == value) continue;
    throw InputError(file + ": parameter '" + name +
                     "': this is a procedure as it was run, with its parameters filled in");
  }
}

bool starts_with(const std::string& line, const char* start) { return line.rfind(start, 0) == 0; }

/// "${name}", ${name}, "$<name>" or $<name>
const std::regex& reference_pattern() {
  static const std::regex pattern(R"((["']?)\$(?:\{([^}]*)\}|<(\w+)>)\1)");
  return pattern;
}

/// What stands for a reference: quotes around it are kept, unless the value is more than text.
std::string put_in(const std::string& value, const std::string& quote) {
  const bool quoted = !value.empty() && (value.front() == '"' || value.front() == '\'');
  return quote.empty() || quoted || is_list(value) ? value : quote + value + quote;
}

}  // namespace

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

std::string known_names(const std::vector<std::string>& names) {
  return names.empty() ? "the procedure has none" : "there are: " + joined(names);
}

std::string fill(const std::string& text, const std::string& name, const std::string& value) {
  const std::string open = "$<" + name + ">";
  std::string result;
  std::size_t from = 0;
  for (auto at = text.find(open); at != std::string::npos; at = text.find(open, from)) {
    const std::size_t end = at + open.size();
    const bool quoted = at > from && end < text.size() &&
                        (text[at - 1] == '"' || text[at - 1] == '\'') && text[end] == text[at - 1];
    const std::string quote = quoted ? text.substr(end, 1) : "";
    result += text.substr(from, at - from - quote.size()) + put_in(value, quote);
    from = end + quote.size();
  }
  return result + text.substr(from);
}

Filled apply_parameters(const std::string& text, const std::string& file,
                        const Overrides& overrides) {
  Lines lines = lines_of(text);
  Filled filled;
  const auto after = std::find_if(lines.begin(), lines.end(),
                                  [](const auto& line) { return starts_with(line, "called:"); });
  const auto count = static_cast<std::size_t>(after - lines.begin());
  filled.as_run = std::any_of(lines.begin(), after,
                              [](const auto& line) { return starts_with(line, "as_run: true"); });
  auto parameters = read_block(lines, file, filled.as_run ? Overrides{} : overrides);
  if (filled.as_run) refuse_other_values(parameters, file, overrides);
  for (const auto& [name, parameter] : parameters) filled.names.push_back(name);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::size_t comment_at = i < count ? comment_start(lines[i]) : 0;
    std::string rest = lines[i].substr(0, comment_at);
    std::string content;
    std::smatch match;
    while (std::regex_search(rest, match, reference_pattern())) {
      const std::string name = match[2].matched ? match[2] : match[3];
      const std::string quote = match[1];
      content += match.prefix();
      if (const auto found = parameters.find(name); found != parameters.end()) {
        found->second.used = true;
        content += put_in(found->second.value, quote);
      } else {
        filled.references.push_back({name, i + 1});
        content += quote + "$<" + name + ">" + quote;
      }
      rest = match.suffix();
    }
    filled.text += content + rest + lines[i].substr(comment_at) + "\n";
  }
  for (const auto& [name, parameter] : parameters) {
    if (!parameter.used) filled.unused.push_back({name, parameter.line + 1});
  }
  return filled;
}

}  // namespace berth::procedures
