// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/json_text.h"

#include <charconv>
#include <cmath>

#include "common/core/valid_text.h"

namespace berth::logs {
namespace {

void append_element(const Field& field, const Value& value, std::size_t dimensions,
                    std::string& out) {
  if (dimensions > 0) {
    out += '[';
    bool first = true;
    for (const Value& v : value.list()) {
      if (!first) out += ',';
      first = false;
      append_element(field, v, dimensions - 1, out);
    }
    out += ']';
    return;
  }
  if (field.kind == Kind::structure) {
    append_json(*field.structure, value, out);
    return;
  }
  std::visit(
      [&out](const auto& v) {
        using Type = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<Type, bool>) {
          out += v ? "true" : "false";
        } else if constexpr (std::is_arithmetic_v<Type>) {
          if constexpr (std::is_floating_point_v<Type>) {
            if (!std::isfinite(v)) {
              out += "null";
              return;
            }
          }
          char text[40];
          out.append(text, std::to_chars(text, text + sizeof text, v).ptr);
        } else if constexpr (std::is_same_v<Type, std::string_view>) {
          append_json(v, out);
        }
      },
      value.content);
}

bool is_plain(std::string_view text) {
  for (const char c : text) {
    if (c < 32 || c == '"' || c == '\\' || c == 127) return false;  // char is signed: no UTF-8
  }
  return true;
}

nlohmann::ordered_json schema_of(const StructType& type, int depth);

nlohmann::ordered_json schema_of(const Field& field, std::size_t dimensions, int depth) {
  if (dimensions > 0) {
    return {{"type", "array"}, {"items", schema_of(field, dimensions - 1, depth)}};
  }
  switch (field.kind) {
    case Kind::structure:
      return schema_of(*field.structure, depth + 1);
    case Kind::text:
      return {{"type", "string"}};
    case Kind::boolean:
      return {{"type", "boolean"}};
    case Kind::real32:
    case Kind::real64:
      return {{"type", "number"}};
    default:
      return {{"type", "integer"}};
  }
}

nlohmann::ordered_json schema_of(const StructType& type, int depth) {
  nlohmann::ordered_json schema = {{"type", "object"}, {"title", type.name}};
  if (!type.comment.empty()) schema["description"] = type.comment;
  schema["properties"] = nlohmann::ordered_json::object();
  if (depth > 8) return schema;  // a type within itself
  for (const Field& field : type.fields) {
    auto& property = schema["properties"][field.name];
    property = schema_of(field, field.dimensions.size(), depth);
    std::string about = field.comment;
    if (!field.unit.empty()) about = "[" + field.unit + "]" + (about.empty() ? "" : " ") + about;
    if (!about.empty()) property["description"] = about;
  }
  return schema;
}

}  // namespace

void append_json(std::string_view text, std::string& out) {
  if (is_plain(text)) {
    out += '"';
    out += text;
    out += '"';
  } else {
    out += json_text(nlohmann::ordered_json(std::string(text)));
  }
}

void append_json(const StructType& type, const Value& value, std::string& out) {
  out += '{';
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    const Field& field = type.fields[i];
    if (i > 0) out += ',';
    out += '"';
    out += field.name;
    out += "\":";
    append_element(field, value.list()[i], field.dimensions.size(), out);
  }
  out += '}';
}

std::string json_schema_of(const StructType& type) { return json_text(schema_of(type, 0)); }

}  // namespace berth::logs
