// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <modbus/modbus.h>

#include <memory>
#include <span>

#include "drivers/modbus/words.h"

namespace berth {

/// The registers and bits that a Modbus server shows. Numbers count from 1.
class ModbusImage {
 public:
  /// @throws std::bad_alloc.
  ModbusImage(int registers, int coils, int inputs);

  Word& holding(int n) { return mapping_->tab_registers[n - 1]; }
  std::span<Word> holding(int first, int count) {
    return {mapping_->tab_registers + first - 1, static_cast<std::size_t>(count)};
  }
  bool coil(int n) const { return mapping_->tab_bits[n - 1] != 0; }
  void set_coil(int n, bool on) { mapping_->tab_bits[n - 1] = on ? 1 : 0; }
  void set_input(int n, bool on) { mapping_->tab_input_bits[n - 1] = on ? 1 : 0; }

  modbus_mapping_t* mapping() { return mapping_.get(); }

 private:
  struct Deleter {
    void operator()(modbus_mapping_t* mapping) const { modbus_mapping_free(mapping); }
  };
  std::unique_ptr<modbus_mapping_t, Deleter> mapping_;
};

}  // namespace berth
