// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "common/core/arm_kinematics.h"
#include "drivers/arm/register_map.h"
#include "drivers/registers/words.h"

namespace berth {

/// A POS or PR element in the pendant's units.
struct SnpxPosition {
  Xyzwpr cartesian{};
  ArmConfiguration configuration;
  bool cartesian_valid = false;
  std::array<double, 6> joints{};  ///< deg, mm
  bool joints_valid = false;
};

/// The registers that a controller shows through its $SNPX_ASG table, and the effect of writes:
/// registers without an assignment read 0 and ignore writes, of overlapping assignments the lower
/// slot wins, POS, PRG and ALM ignore writes. The table itself is among the variables.
class SnpxMemory {
 public:
  explicit SnpxMemory(const std::vector<SnpxAssignment>& assignments);
  SnpxMemory(const SnpxMemory&) = delete;
  SnpxMemory& operator=(const SnpxMemory&) = delete;

  // Variables, to be kept up to date before a read.
  SnpxPosition position;                            ///< POS[0], POS[15]
  std::array<SnpxPosition, 11> position_registers;  ///< PR[1..10]
  std::array<double, 201> numbers{};                ///< R[1..200]
  std::string program_name = "BERTH";
  int program_line = 1;
  int program_state = 0;
  int alarm_number = 0;
  std::string alarm_text;

  /// Fills registers first ... first+words.size()-1 as they are shown.
  void read(int first, std::span<Word> words) const;
  /// Takes what was written to them.
  void write(int first, std::span<const Word> words);

  const SnpxAssignment* assignment(int slot) const;
  void assign(const SnpxAssignment& assignment);

 private:
  struct Slot {
    SnpxAssignment assignment;
    SnpxVariable variable;
  };

  /// The slot that shows a register, or null.
  const Slot* owner(int address) const;
  void find_owners();
  /// All words of one element, encoded with the slot's multiply. words: element_words of its kind,
  /// for texts the slot's size.
  void encode(const Slot& slot, int index, std::span<Word> words) const;
  void decode(const Slot& slot, int index, std::span<const Word> words);
  void encode_position(const SnpxPosition& value, int multiply, std::span<Word> words) const;
  void decode_position(SnpxPosition& value, int multiply, std::span<const Word> words) const;
  void encode_system(const Slot& slot, std::span<Word> words) const;
  void decode_system(const Slot& slot, std::span<const Word> words);
  int element_size(const Slot& slot) const;

  std::map<int, Slot> slots_;
  std::vector<const Slot*> owners_;  // of each register; null: none
  mutable std::vector<Word> element_;
};

}  // namespace berth
