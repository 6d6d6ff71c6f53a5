// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "drivers/registers/words.h"

namespace berth {

/// The register map of the facility's PLC, from a file of config/registers. Registers count from 1.
struct PlcMap {
  struct Block {
    int first = 1;
    int count = 0;
  };
  /// Addresses of a value's state and of its command.
  struct Value {
    int status = 0;
    int command = 0;
  };

  int unit = 1;
  Block status;
  Block command;
  int safety = 0;  ///< status word with the bits
  int estop_bit = 0;
  int fence_bit = 0;
  int motion_bit = 0;
  Value sun_lamp;
  Value albedo_lamp;
  Value sun_azimuth;
  Value sun_elevation;
  int heartbeat = 0;

  /// @throws InputError, also when a register lies outside its block.
  static PlcMap load(const std::filesystem::path& path);
};

/// Levels 0..1 in 0..10000; angles (rad) in hundredths of a degree, within half a turn of zero.
Word word_from_level(double level);
double level_from_word(Word word);
Word word_from_angle(double angle);
double angle_from_word(Word word);

}  // namespace berth
