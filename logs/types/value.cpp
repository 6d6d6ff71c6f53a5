// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/value.h"

#include <bit>

#include "logs/types/lcm_type.h"
#include "logs/types/type_catalogue.h"

namespace berth::logs {
namespace {

constexpr int deepest = 64;  // structs within structs
constexpr int max_slots = 32;

/// Walks over a message along its type. Values are made only where a list for them is given.
class Walker {
 public:
  explicit Walker(Bytes message)
      : at_(message.data()), end_(at_ + message.size()), bytes_(message.size()) {}

  bool at_end() const { return at_ == end_; }
  bool skip(std::size_t bytes) {
    if (bytes > static_cast<std::size_t>(end_ - at_)) return false;
    at_ += bytes;
    return true;
  }

  bool structure(const StructType& type, Value::List* out, int depth = 0) {
    if (out == nullptr && type.fixed_bytes) return skip(*type.fixed_bytes);
    if (depth > deepest || type.count_slots > max_slots) return false;
    if (out != nullptr) out->reserve(type.fields.size());
    std::int64_t counts[max_slots];
    for (const Field& field : type.fields) {
      if (field.count_slot >= 0 && !read_count(field.kind, counts[field.count_slot])) return false;
      if (!array(type, field, 0, counts, out, depth)) return false;
    }
    return true;
  }

 private:
  bool read_count(Kind kind, std::int64_t& count) const {
    if (*wire::bytes_of(kind) > static_cast<std::size_t>(end_ - at_)) return false;
    count = wire::integer_of(kind, at_);
    return true;
  }

  /// The field's elements from this dimension on.
  bool array(const StructType& type, const Field& field, std::size_t dimension,
             const std::int64_t* counts, Value::List* out, int depth) {
    if (dimension == field.dimensions.size()) return element(field, out, depth);
    const Dimension& d = field.dimensions[dimension];
    const std::int64_t length =
        d.count_field < 0 ? d.length
                          : counts[type.fields[static_cast<std::size_t>(d.count_field)].count_slot];
    // The size in a damaged message has to fit its bytes: this bounds time and memory.
    if (length < 0 || (d.count_field >= 0 && static_cast<std::size_t>(length) > bytes_))
      return false;
    const auto n = static_cast<std::size_t>(length);
    const bool innermost = dimension + 1 == field.dimensions.size();
    if (out == nullptr && innermost && field.kind != Kind::structure && field.kind != Kind::text) {
      return skip(n * *wire::bytes_of(field.kind));
    }
    Value::List* list = nullptr;
    if (out != nullptr) {
      out->push_back({Value::List()});
      list = &std::get<Value::List>(out->back().content);
      if (innermost) list->reserve(n);
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (++elements_ > 2 * bytes_ + 100000) return false;
      if (!array(type, field, dimension + 1, counts, list, depth)) return false;
    }
    return true;
  }

  bool element(const Field& field, Value::List* out, int depth) {
    if (field.kind == Kind::text) return text(out);
    if (field.kind == Kind::structure) {
      if (out == nullptr) return structure(*field.structure, nullptr, depth + 1);
      out->push_back({Value::List()});
      return structure(*field.structure, &std::get<Value::List>(out->back().content), depth + 1);
    }
    const std::uint8_t* from = at_;
    if (!skip(*wire::bytes_of(field.kind))) return false;
    if (out == nullptr) return true;
    if (field.kind == Kind::real64) {
      out->push_back({std::bit_cast<double>(wire::unsigned_of<8>(from))});
    } else if (field.kind == Kind::real32) {
      out->push_back(
          {std::bit_cast<float>(static_cast<std::uint32_t>(wire::unsigned_of<4>(from)))});
    } else if (field.kind == Kind::boolean) {
      out->push_back({*from != 0});
    } else {
      out->push_back({wire::integer_of(field.kind, from)});
    }
    return true;
  }

  /// A length that counts the zero byte at the end, then the text with it.
  bool text(Value::List* out) {
    const std::uint8_t* from = at_;
    if (!skip(4)) return false;
    const std::int64_t length = wire::signed_of<4>(from);
    if (length < 1 || !skip(static_cast<std::size_t>(length)) || at_[-1] != 0) return false;
    if (out != nullptr) {
      const auto* characters = reinterpret_cast<const char*>(from + 4);
      out->push_back({std::string_view(characters, static_cast<std::size_t>(length) - 1)});
    }
    return true;
  }

  const std::uint8_t* at_;
  const std::uint8_t* end_;
  std::size_t bytes_;
  std::size_t elements_ = 0;
};

bool walk(const StructType& type, Bytes message, Value::List* out) {
  if (message.size() < 8 || fingerprint_of(message) != type.fingerprint) return false;
  Walker walker(message.subspan(8));
  return walker.structure(type, out) && walker.at_end();
}

nlohmann::ordered_json json_of_element(const Field& field, const Value& value,
                                       std::size_t dimensions) {
  if (dimensions > 0) {
    auto list = nlohmann::ordered_json::array();
    for (const Value& v : value.list()) list.push_back(json_of_element(field, v, dimensions - 1));
    return list;
  }
  if (field.kind == Kind::structure) return json_of(*field.structure, value);
  return std::visit(
      [](const auto& v) -> nlohmann::ordered_json {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, Value::List>) {
          return nullptr;
        } else {
          return v;
        }
      },
      value.content);
}

}  // namespace

bool is_message(const StructType& type, Bytes message) { return walk(type, message, nullptr); }

std::optional<Value> decode_value(const StructType& type, Bytes message) {
  if (!is_message(type, message)) return std::nullopt;
  Value::List fields;
  if (!walk(type, message, &fields)) return std::nullopt;
  return Value{std::move(fields)};
}

nlohmann::ordered_json json_of(const StructType& type, const Value& value) {
  auto object = nlohmann::ordered_json::object();
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    const Field& field = type.fields[i];
    object[field.name] = json_of_element(field, value.list()[i], field.dimensions.size());
  }
  return object;
}

std::optional<double> number_of(const Value& value) {
  return std::visit(
      [](const auto& v) -> std::optional<double> {
        if constexpr (std::is_arithmetic_v<std::decay_t<decltype(v)>>) {
          return static_cast<double>(v);
        } else {
          return std::nullopt;
        }
      },
      value.content);
}

}  // namespace berth::logs
