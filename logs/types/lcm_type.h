// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/loop.h"

namespace berth::logs {

struct StructType;

/// What one element of a field is on the wire.
enum class Kind : std::uint8_t {
  int8,
  int16,
  int32,
  int64,
  byte,
  boolean,
  real32,
  real64,
  text,
  structure
};

/// One dimension of an array: of constant size, or of the size in an earlier field.
struct Dimension {
  std::string size;         ///< as written
  int count_field = -1;     ///< index of the field with the size; -1: constant
  std::int64_t length = 0;  ///< of a fixed one
};

struct Field {
  std::string name;
  std::string type_name;  ///< as lcm-gen has it: "double", "berth.waypoint_t"
  Kind kind = Kind::int8;
  const StructType* structure = nullptr;  ///< of Kind::structure
  std::vector<Dimension> dimensions;
  std::string comment;
  std::string unit;     ///< "m", "rad/s", "us" ...; empty: none, or not given
  int count_slot = -1;  ///< not -1: the size of an array after it
};

struct Constant {
  std::string type_name;
  std::string name;
  std::string text;  ///< as written
};

/// One struct of a .lcm file.
struct StructType {
  std::string name;    ///< with its package: "berth.event_t"
  std::string source;  ///< "file:line"
  std::string comment;
  std::vector<Field> fields;
  std::vector<Constant> constants;
  int count_slots = 0;
  std::uint64_t base_hash = 0;             ///< over its own names and types, as lcm-gen has it
  std::uint64_t fingerprint = 0;           ///< first eight bytes of a message
  std::optional<std::size_t> fixed_bytes;  ///< on the wire, when it is always the same

  const Field* field(const std::string& name) const;
};

}  // namespace berth::logs

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

namespace berth::logs {

/// "event_t" for ours, "other.lab.survey_t" for others.
std::string short_name(const StructType& type);

/// "0xc4a27e6fb13d03d5".
std::string hexadecimal(std::uint64_t fingerprint);

/// "2026-11-21 13:30:54.123456", UTC.
std::string text_of_utime(Utime utime);

}  // namespace berth::logs
