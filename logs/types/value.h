// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "common/bus/bus.h"
#include "logs/types/lcm_type.h"

namespace berth::logs {

/// The value of a field. A struct is the list of its fields' values, in their order; an array the
/// list of its elements, or of its rows. Texts are views into the message.
struct Value {
  using List = std::vector<Value>;
  std::variant<std::int64_t, double, float, bool, std::string_view, List> content;

  const List& list() const { return std::get<List>(content); }
  bool operator==(const Value& other) const = default;
};

/// Whether these bytes are one message of the type: fingerprint, all lengths, texts that end as
/// they must, and not a byte more. Allocates nothing.
bool is_message(const StructType& type, Bytes message);

/// The fields of a message; nothing when is_message() is false. Never throws on damaged bytes, nor
/// allocates more than some 32 times their size.
std::optional<Value> decode_value(const StructType& type, Bytes message);

/// As an object with the fields in their order. Numbers that are not finite are null.
nlohmann::ordered_json json_of(const StructType& type, const Value& value);

/// The number in a field; nothing for texts and lists.
std::optional<double> number_of(const Value& value);

}  // namespace berth::logs
