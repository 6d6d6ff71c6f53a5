// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/snpx_variable.h"

#include <regex>

namespace berth {

int element_words(SnpxVariable::Kind kind) {
  switch (kind) {
    case SnpxVariable::Kind::position:
    case SnpxVariable::Kind::position_register:
      return position_words::count;
    case SnpxVariable::Kind::program:
      return program_words::count;
    case SnpxVariable::Kind::alarm:
      return alarm_words::count;
    case SnpxVariable::Kind::number:
    case SnpxVariable::Kind::system:
      break;
  }
  return 2;
}

std::optional<SnpxVariable> parse_snpx_variable(const std::string& text) {
  SnpxVariable variable;
  if (!text.empty() && text.front() == '$') {
    variable.kind = SnpxVariable::Kind::system;
    variable.name = text;
    return variable;
  }
  static const std::regex grammar(
      R"((R|POS|PR|PRG|ALM)\[(?:G1:)?([0-9]{1,5})\](?:@([0-9]{1,3})\.([0-9]{1,3}))?)");
  std::smatch match;
  if (!std::regex_match(text, match, grammar)) return std::nullopt;
  using Kind = SnpxVariable::Kind;
  const std::string kind = match[1];
  variable.kind = kind == "R"     ? Kind::number
                  : kind == "POS" ? Kind::position
                  : kind == "PR"  ? Kind::position_register
                  : kind == "PRG" ? Kind::program
                                  : Kind::alarm;
  variable.index = std::stoi(match[2]);
  variable.words = element_words(variable.kind);
  if (match[3].matched) {
    variable.first_word = std::stoi(match[3]);
    const int words = std::stoi(match[4]);
    if (variable.first_word < 1 || words < 1 || variable.first_word + words - 1 > variable.words) {
      return std::nullopt;
    }
    variable.words = words;
  }
  return variable;
}

}  // namespace berth
