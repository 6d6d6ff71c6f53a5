// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

/// One dimension of an array: of a size that is written down, or that an earlier field tells.
struct Dimension {
  std::string size;         ///< as written
  int count_field = -1;     ///< index of the field that tells it; -1: it is fixed
  std::int64_t length = 0;  ///< of a fixed one
};

struct Field {
  std::string name;
  std::string type_name;  ///< as lcm-gen has it: "double", "berth.waypoint_t"
  Kind kind = Kind::int8;
  const StructType* structure = nullptr;  ///< of Kind::structure
  std::vector<Dimension> dimensions;
  std::string comment;
  std::string unit;     ///< "m", "rad/s", "us" ...; empty: none, or none is told
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
