// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "logs/types/lcm_type.h"

/// LCM's encoding: big-endian, no padding.
namespace berth::logs::wire {

/// The first N bytes as an unsigned number.
template <int N>
std::uint64_t unsigned_of(const std::uint8_t* at) {
  std::uint64_t value = 0;
  for (int i = 0; i < N; ++i) value = value << 8 | at[i];
  return value;
}

/// The first so many bytes as a signed number.
template <int N>
std::int64_t signed_of(const std::uint8_t* at) {
  constexpr int unused = 64 - 8 * N;
  return static_cast<std::int64_t>(unsigned_of<N>(at) << unused) >> unused;
}

inline std::int64_t integer_of(Kind kind, const std::uint8_t* at) {
  switch (kind) {
    case Kind::int8:
      return signed_of<1>(at);
    case Kind::int16:
      return signed_of<2>(at);
    case Kind::int32:
      return signed_of<4>(at);
    case Kind::int64:
      return signed_of<8>(at);
    default:
      return static_cast<std::int64_t>(unsigned_of<1>(at));
  }
}

/// Of one element; nothing for strings and structs.
constexpr std::optional<std::size_t> bytes_of(Kind kind) {
  switch (kind) {
    case Kind::int8:
    case Kind::byte:
    case Kind::boolean:
      return 1;
    case Kind::int16:
      return 2;
    case Kind::int32:
    case Kind::real32:
      return 4;
    case Kind::int64:
    case Kind::real64:
      return 8;
    default:
      return std::nullopt;
  }
}

}  // namespace berth::logs::wire
