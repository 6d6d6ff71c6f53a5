// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace berth {

/// Values in 16-bit Modbus registers, packed here and not by libmodbus: version 3.1.6 as Debian has
/// it writes modbus_set_float_cdab and _abcd with swapped bytes.
using Word = std::uint16_t;

/// 32-bit values, low word first ("CDAB"): the Fanuc order.
void put_float(float value, Word* two);
float get_float(const Word* two);
void put_int32(std::int32_t value, Word* two);
std::int32_t get_int32(const Word* two);

/// Text, two characters a word, the first in the high byte; zeros behind it.
void put_text(const std::string& text, std::span<Word> words);
/// Up to the first zero.
std::string get_text(std::span<const Word> words);

}  // namespace berth
