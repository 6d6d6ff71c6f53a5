// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "drivers/registers/words.h"

namespace berth {

enum class RegisterTable { registers, coils, inputs };

/// The registers and bits that a device shows. Numbers count from 1.
class RegisterImage {
 public:
  RegisterImage(int registers, int coils, int inputs)
      : registers_(static_cast<std::size_t>(registers)),
        coils_(static_cast<std::size_t>(coils)),
        inputs_(static_cast<std::size_t>(inputs)) {}

  Word& holding(int n) { return registers_[index(n)]; }
  std::span<Word> holding(int first, int count) {
    return std::span(registers_).subspan(index(first), static_cast<std::size_t>(count));
  }
  bool coil(int n) const { return coils_[index(n)] != 0; }
  void set_coil(int n, bool on) { coils_[index(n)] = on ? 1 : 0; }
  bool input(int n) const { return inputs_[index(n)] != 0; }
  void set_input(int n, bool on) { inputs_[index(n)] = on ? 1 : 0; }

  /// Of libmodbus' server, into this memory.
  Word* registers() { return registers_.data(); }
  std::uint8_t* coils() { return coils_.data(); }
  std::uint8_t* inputs() { return inputs_.data(); }

  bool holds(RegisterTable table, int first, int count) const {
    return first >= 1 && count >= 1 && count <= size(table) - first + 1;
  }
  int size(RegisterTable table) const {
    const std::size_t size = table == RegisterTable::registers ? registers_.size()
                             : table == RegisterTable::coils   ? coils_.size()
                                                               : inputs_.size();
    return static_cast<int>(size);
  }

 private:
  static std::size_t index(int n) { return static_cast<std::size_t>(n - 1); }

  std::vector<Word> registers_;
  std::vector<std::uint8_t> coils_;
  std::vector<std::uint8_t> inputs_;
};

}  // namespace berth
