// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "app/configuration/described_keys.h"
#include "common/core/valid_text.h"

namespace berth {
namespace {

using json = nlohmann::ordered_json;
using Kind = ConfigKey::Kind;

constexpr char number_pattern[] = R"([-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)";

json limits_of(const ValueBounds& bounds) {
  json limits = json::object();
  const auto add = [&](const char* name, double value) {
    if (!std::isfinite(value)) return;
    if (value == std::round(value)) {
      limits[name] = static_cast<std::int64_t>(value);
    } else {
      limits[name] = value;
    }
  };
  add(bounds.has_low ? "minimum" : "exclusiveMinimum", bounds.low);
  add(bounds.has_high ? "maximum" : "exclusiveMaximum", bounds.high);
  return limits;
}

/// Text of a number and one of the units, as "20 mm/s"; of a bare number the number, or a share.
json quantity(Dimension dimension, const ValueBounds& bounds) {
  std::string units;
  for (const std::string& name : unit_names(dimension)) {
    if (name.empty()) continue;
    units += units.empty() ? "" : "|";
    for (const char c : name) units += c == '^' ? "\\^" : std::string(1, c);
  }
  const json text = {
      {"type", "string"},
      {"pattern", std::string("^\\s*") + number_pattern + "\\s*(" + units + ")\\s*$"}};
  if (dimension != Dimension::number) return text;
  json number = {{"type", "number"}};
  number.update(limits_of(bounds));
  return {{"anyOf", json::array({number, text})}};
}

json list_of(const json& items, int size) {
  json list = {{"type", "array"}, {"items", items}};
  if (size > 0) list["minItems"] = list["maxItems"] = size;
  return list;
}

class Writer {
 public:
  explicit Writer(const std::vector<DescribedKey>& keys) {
    for (const DescribedKey& one : keys) {
      const std::size_t dot = one.key.path.rfind('.');
      const std::string in = dot == std::string::npos ? "" : one.key.path.substr(0, dot);
      within_[in].push_back(&one);
    }
  }

  /// The map at a path.
  json map(const std::string& path) const {
    json object = {{"type", "object"}};
    const auto found = within_.find(path);
    if (found == within_.end()) return object;
    json properties = json::object();
    json required = json::array();
    json others = false;
    for (const DescribedKey* one : found->second) {
      const std::string& whole = one->key.path;
      const std::string name = path.empty() ? whole : whole.substr(path.size() + 1);
      if (name == "NAME") {
        others = described(*one);
        continue;
      }
      properties[name] = described(*one);
      if (one->key.required) required.push_back(name);
    }
    if (!properties.empty()) object["properties"] = properties;
    if (!required.empty()) object["required"] = required;
    object["additionalProperties"] = others;
    return object;
  }

 private:
  json value_of(const ConfigKey& key) const {
    switch (key.kind) {
      case Kind::quantity:
        return quantity(key.dimension, key.bounds);
      case Kind::quantities:
        return list_of(quantity(key.dimension, key.bounds), key.size);
      case Kind::integer: {
        json number = {{"type", "integer"}};
        number.update(limits_of(key.bounds));
        return number;
      }
      case Kind::integers:
        return list_of({{"type", "integer"}}, 0);
      case Kind::boolean:
        return {{"type", "boolean"}};
      case Kind::text:
        return {{"type", json::array({"string", "number", "boolean"})}};
      case Kind::texts:
        return list_of({{"type", json::array({"string", "number", "boolean"})}}, 0);
      case Kind::choice:
        return {{"enum", key.words}};
      case Kind::pose:
        return list_of({{"type", "number"}}, 6);
      case Kind::map:
        return map(key.path);
      case Kind::maps:
        return list_of(map(key.path + "[]"), 0);
      case Kind::other:
        return json::object();
    }
    return json::object();
  }

  json described(const DescribedKey& one) const {
    json value = value_of(one.key);
    std::string text = one.meaning;
    const auto add = [&text](const std::string& more) {
      text += (text.empty() ? "" : "; ") + more;
    };
    if (one.key.kind == Kind::quantity) {
      if (const std::string bounds = text_of(one.key.bounds, one.key.dimension); !bounds.empty()) {
        add(bounds);
      }
    }
    if (!one.key.default_value.empty()) add("default: " + one.key.default_value);
    if (!text.empty()) value["description"] = text;
    return value;
  }

  std::map<std::string, std::vector<const DescribedKey*>> within_;
};

}  // namespace

std::string key_schema(const ConfigKind& kind, const std::vector<DescribedKey>& keys) {
  json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", kind.files + ": " + kind.what}};
  schema.update(Writer(keys).map(""));
  return json_text(schema, 1) + "\n";
}

}  // namespace berth
