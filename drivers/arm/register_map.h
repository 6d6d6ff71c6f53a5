// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "drivers/arm/snpx_variable.h"
#include "drivers/registers/words.h"

namespace berth {

/// One entry of a controller's $SNPX_ASG: registers address ... address+size-1 show a variable.
struct SnpxAssignment {
  int slot = 0;     ///< 1..80; of two that overlap the lower wins
  int address = 0;  ///< first register, from 1
  int size = 0;     ///< registers
  std::string variable;
  int multiply = 0;  ///< 0: float32; -1: text and words; else int32 of round(value * multiply)

  bool operator==(const SnpxAssignment&) const = default;
};

/// Where a number stands in the registers, and how it is written there.
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

/// Where word `word` (from 1) of the variable "R[7]" or "PR[1]" stands.
struct VariableLocation {
  int address = 0;
  int multiply = 0;
};
std::optional<VariableLocation> locate(const std::vector<SnpxAssignment>& assignments,
                                       const SnpxVariable& variable, int word);

}  // namespace berth
