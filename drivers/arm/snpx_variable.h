// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

namespace berth {

/// What a $VAR_NAME of a Fanuc SNPX assignment names.
struct SnpxVariable {
  enum class Kind {
    number,             ///< R[n]: 2 words each
    position,           ///< POS[uf]: the current position, 50 words, read-only
    position_register,  ///< PR[n]: 50 words each
    program,            ///< PRG[n]: 18 words
    alarm,              ///< ALM[n]: 100 words
    system,             ///< $name
  };
  Kind kind = Kind::number;
  int index = 0;       ///< n
  int first_word = 1;  ///< a of "@a.b"
  int words = 2;       ///< b of "@a.b", else all words of an element
  std::string name;    ///< of a system variable

  bool operator==(const SnpxVariable&) const = default;
};

/// Words of one element of a kind.
int element_words(SnpxVariable::Kind kind);

/// Words within a POS or PR element.
namespace position_words {
inline constexpr int cartesian = 1;  ///< X Y Z W P R, 2 words each
inline constexpr int flip = 19;      ///< FLIP, LEFT, UP, FRONT
inline constexpr int turns = 23;     ///< TURN4, TURN5, TURN6
inline constexpr int cartesian_valid = 26;
inline constexpr int joints = 27;  ///< J1 ... J9, 2 words each
inline constexpr int joints_valid = 45;
inline constexpr int frame = 46;  ///< UF
inline constexpr int tool = 47;   ///< UT; 0: the flange itself
inline constexpr int count = 50;
}  // namespace position_words

/// Words within a PRG element.
namespace program_words {
inline constexpr int name = 1;
inline constexpr int line = 9;
inline constexpr int state = 10;  ///< 0 aborted, 1 paused, 2 running
inline constexpr int count = 18;
}  // namespace program_words

/// Words within an ALM element.
namespace alarm_words {
inline constexpr int id = 1;
inline constexpr int number = 2;
inline constexpr int severity = 5;
inline constexpr int text = 12;  ///< 40 words
inline constexpr int text_words = 40;
inline constexpr int text_end = text + text_words - 1;
inline constexpr int count = 100;
}  // namespace alarm_words

/// Nothing when the text names no variable that this code knows.
std::optional<SnpxVariable> parse_snpx_variable(const std::string& text);

}  // namespace berth
