// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "drivers/arm/adapter.h"
#include "drivers/registers/words.h"

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

/// Nothing when the text names no known variable.
std::optional<SnpxVariable> parse_snpx_variable(const std::string& text);

/// One entry of a controller's $SNPX_ASG: registers address ... address+size-1 show a variable.
struct SnpxAssignment {
  int slot = 0;     ///< 1..80; of two that overlap the lower wins
  int address = 0;  ///< first register, from 1
  int size = 0;     ///< registers
  std::string variable;
  int multiply = 0;  ///< 0: float32; -1: text and words; else int32 of round(value * multiply)

  bool operator==(const SnpxAssignment&) const = default;
};

/// Address and encoding of a number in the registers.
struct RegisterField {
  enum class Form { float32, int32 };
  int address = 0;  ///< first of two registers
  Form form = Form::float32;
  double multiply = 1;

  double get(const Word* two) const;
  void put(double value, Word* two) const;
};

struct RegisterBlock {
  int first = 1;
  int count = 0;
  bool contains(int address, int size) const {
    return address >= first && address + size <= first + count;
  }
};

/// The register map of one arm controller, from a file of config/registers: which assignments the
/// controller must have, and where in them the driver finds what it needs.
struct RegisterMap {
  int unit = 1;
  std::vector<SnpxAssignment> assignments;  ///< by slot
  RegisterBlock status;                     ///< read at once
  RegisterBlock command;                    ///< written at once

  /// Fields of slot 80 at `first`; through them slot 80 is made to show any variable at `peephole`.
  struct Bootstrap {
    int first = 0;
    int peephole = 0;
    static constexpr int slot = 80;
    static constexpr int size_at = 2;
    static constexpr int name_at = 4;
    static constexpr int name_words = 40;
    static constexpr int multiply_at = 44;
    static constexpr int words = 46;
  };
  std::optional<Bootstrap> bootstrap;

  int position = 0;         ///< first register of the position element
  int setpoint_joints = 0;  ///< first register of J1
  int setpoint_valid = 0;
  int program_state = 0;
  int alarm = 0;  ///< first register of the newest alarm; 0: the map has none

  RegisterField tick, heartbeat, setpoint_taken, state, speed_override, tcp_speed, error;
  RegisterField setpoint_sequence, command_word, host_heartbeat, speed_limit, setpoint_time, mode;

  Utime tick_period = 8 * millisecond;
  int counter_wrap = 1 << 24;
  int start_coil = 0;
  int hold_coil = 0;
  int reset_coil = 0;
  Utime pulse = 200 * millisecond;

  /// @throws InputError, also when a field is not covered by the assignments or outside its block.
  static RegisterMap load(const std::filesystem::path& path);

  /// The lines that set the controller up, one system variable each.
  std::string assignment_table() const;
};

/// Register of word `word` (from 1) of the variable "R[7]" or "PR[1]".
struct VariableLocation {
  int address = 0;
  int multiply = 0;
};
std::optional<VariableLocation> locate(const std::vector<SnpxAssignment>& assignments,
                                       const SnpxVariable& variable, int word);

/// Translates between registers and SI units: the pendant counts degrees and, for linear axes, mm.
class ArmRegisterCodec {
 public:
  ArmRegisterCodec(RegisterMap map, std::array<bool, 6> linear)
      : map_(std::move(map)), linear_(linear) {}

  const RegisterMap& map() const { return map_; }
  /// words: map().status.count of them. tick_ms: the controller's clock, wrapped; the report has
  /// no time yet.
  ArmReport decode(std::span<const Word> words, int& tick_ms) const;
  /// The whole command block; valid until the next call.
  std::span<const Word> encode(const ArmOrder& order, int host_heartbeat);

 private:
  RegisterMap map_;
  std::array<bool, 6> linear_;
  std::vector<Word> block_;
};

/// Which joints are linear.
std::array<bool, 6> linear_axes(const ArmKinematics& kinematics);

/// Degrees or mm of one joint, and back.
double pendant_from_si(double value, bool linear);
double si_from_pendant(double value, bool linear);

}  // namespace berth
