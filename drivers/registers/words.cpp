// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/registers/words.h"

#include <cstring>

namespace berth {
namespace {

void put_bits(std::uint32_t bits, Word* two) {
  two[0] = static_cast<Word>(bits & 0xffff);
  two[1] = static_cast<Word>(bits >> 16);
}

std::uint32_t get_bits(const Word* two) {
  return static_cast<std::uint32_t>(two[0]) | static_cast<std::uint32_t>(two[1]) << 16;
}

}  // namespace

void put_float(float value, Word* two) {
  std::uint32_t bits = 0;
  std::memcpy(&bits, &value, sizeof bits);
  put_bits(bits, two);
}

float get_float(const Word* two) {
  const std::uint32_t bits = get_bits(two);
  float value = 0;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

void put_int32(std::int32_t value, Word* two) { put_bits(static_cast<std::uint32_t>(value), two); }

std::int32_t get_int32(const Word* two) { return static_cast<std::int32_t>(get_bits(two)); }

void put_text(const std::string& text, std::span<Word> words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    const auto byte = [&](std::size_t at) {
      return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u;
    };
    words[i] = static_cast<Word>(byte(2 * i) << 8 | byte(2 * i + 1));
  }
}

std::string get_text(std::span<const Word> words) {
  std::string text;
  for (const Word word : words) {
    for (const int byte : {word >> 8, word & 0xff}) {
      if (byte == 0) return text;
      text.push_back(static_cast<char>(byte));
    }
  }
  return text;
}

}  // namespace berth
