// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/schema.h"

#include <map>
#include <nlohmann/json.hpp>

#include "common/core/valid_text.h"
#include "procedures/language/blocks.h"
#include "procedures/language/procedure.h"
#include "procedures/language/step_options.h"
#include "procedures/language/verbs.h"

namespace berth::procedures {
namespace {

using json = nlohmann::ordered_json;

/// A parameter or swept name in place of any value.
const char* const reference = R"(\$\{\w+\})";

json ref(const std::string& name) { return {{"$ref", "#/definitions/" + name}}; }

/// Text of a number and one of the units, such as "20 mm/s".
json quantity(const std::string& units, bool bare_number) {
  const std::string number = R"([-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)";
  json text = {{"type", "string"},
               {"pattern", "^\\s*" + number + "\\s*(" + units + ")\\s*$|" + reference}};
  if (!bare_number) return text;
  return {{"anyOf", json::array({{{"type", "number"}}, text})}};
}

/// Text of a number and a unit of the dimension.
json quantity(Dimension dimension) {
  std::string units;
  for (const std::string& name : unit_names(dimension)) units += (units.empty() ? "" : "|") + name;
  return quantity(units, false);
}

json list_of(const json& items, int min_items = 1) {
  return {{"anyOf", json::array({{{"type", "array"}, {"items", items}, {"minItems", min_items}},
                                 ref("reference")})}};
}

json pose() {
  return {
      {"anyOf",
       json::array({{{"type", "array"}, {"items", ref("number")}, {"minItems", 6}, {"maxItems", 6}},
                    ref("reference")})}};
}

json object(const json& properties, const std::vector<std::string>& required) {
  return {{"type", "object"},
          {"properties", properties},
          {"required", required},
          {"additionalProperties", false}};
}

json definitions() {
  json d;
  d["reference"] = {{"type", "string"}, {"pattern", std::string("^") + reference + "$"}};
  d["number"] = quantity("%?", true);
  d["length"] = quantity(Dimension::length);
  d["angle"] = quantity(Dimension::angle);
  d["time"] = quantity(Dimension::time);
  d["speed"] = quantity(Dimension::speed);
  d["angular_speed"] = quantity(Dimension::angular_speed);
  d["frequency"] = quantity(Dimension::frequency);
  d["quantity"] = quantity(".*", true);
  d["count"] = {{"anyOf", json::array({{{"type", "integer"}, {"minimum", 0}}, ref("reference")})}};
  d["boolean"] = {{"anyOf", json::array({{{"type", "boolean"}}, ref("reference")})}};
  d["text"] = {{"type", json::array({"string", "number", "boolean"})}};
  d["pose"] = pose();
  d["live"] = {{"anyOf", json::array()}};
  for (const LiveQuantity& live : live_quantities()) {
    d["live"]["anyOf"].push_back({{"const", live.name}, {"description", live.description}});
  }
  d["live"]["anyOf"].push_back(ref("reference"));
  d["condition"] = {{"type", "string"},
                    {"examples", {"estimated_range < 4 m for 1 s", "estimate is ok"}}};
  return d;
}

json object_of(const std::vector<KeyInfo>& keys);

/// Schema of a key's value.
json value_of(const KeyInfo& info) {
  switch (info.kind) {
    case Kind::number:
      return ref("number");
    case Kind::length:
      return ref("length");
    case Kind::angle:
      return ref("angle");
    case Kind::time:
      return ref("time");
    case Kind::speed:
      return ref("speed");
    case Kind::angular_speed:
      return ref("angular_speed");
    case Kind::quantity:
      return ref("quantity");
    case Kind::count:
      return ref("count");
    case Kind::boolean:
      return ref("boolean");
    case Kind::text:
      return ref("text");
    case Kind::texts:
      return list_of(ref("text"));
    case Kind::words:
      return {{"anyOf", json::array({{{"enum", info.words}}, ref("reference")})}};
    case Kind::pose:
      return ref("pose");
    case Kind::poses:
      return list_of(ref("pose"));
    case Kind::gate:
      return list_of(ref("length"), 2);
    case Kind::trajectory:
      return object_of(trajectory_keys());
    case Kind::waypoints:
      return list_of(object({{"at", ref("time")}, {"pose", ref("pose")}}, {"at", "pose"}));
    case Kind::condition:
      return ref("condition");
    case Kind::live:
      return ref("live");
    case Kind::values: {
      const json range =
          object({{"from", ref("quantity")}, {"to", ref("quantity")}, {"step", ref("quantity")}},
                 {"from", "to", "step"});
      return {
          {"anyOf", json::array({{{"type", "array"}, {"minItems", 1}}, range, ref("reference")})}};
    }
    case Kind::lengths:
      return list_of(ref("length"));
    case Kind::vector:
      return list_of(ref("quantity"), 3);
    case Kind::map:
      return object_of(info.keys);
    case Kind::assignments:
      return {{"type", "object"}};
    case Kind::steps:
      return {{"type", "array"}, {"items", ref("step")}, {"minItems", 1}};
    case Kind::limits:
      return {{"type", "array"}, {"items", ref("limit")}};
    case Kind::criteria:
      return {{"type", "array"}, {"items", ref("criterion")}};
    case Kind::figures:
      return {{"type", "array"}, {"items", ref("figure")}};
  }
  return {};
}

json described(const KeyInfo& info) {
  json value = value_of(info);
  // Next to a $ref other keywords are ignored.
  if (value.contains("$ref")) value = {{"allOf", json::array({value})}};
  value["description"] =
      info.description +
      (info.default_value.empty() ? "" : " (default: " + info.default_value + ")");
  return value;
}

json object_of(const std::vector<KeyInfo>& keys) {
  json properties;
  std::vector<std::string> required;
  json result;
  for (const KeyInfo& key : keys) {
    if (key.key == "NAME") {
      result["additionalProperties"] = described(key);  // the user's own names
      continue;
    }
    properties[key.key] = described(key);
    if (key.required) required.push_back(key.key);
  }
  json rest = object(properties, required);
  if (result.contains("additionalProperties")) {
    rest["additionalProperties"] = result["additionalProperties"];
  }
  return rest;
}

json behind(const VerbInfo& verb) {
  json forms = json::array();
  if (!verb.keys.empty()) forms.push_back(object_of(verb.keys));
  if (verb.value) forms.push_back(value_of({"", *verb.value, false, "", ""}));
  if (!verb.value && (verb.keys.empty() || (verb.from_map && verb.from_value))) {
    forms.push_back({{"type", "null"}});
  }
  json result = forms.size() == 1 ? forms[0] : json{{"anyOf", forms}};
  if (result.contains("$ref")) result = {{"allOf", json::array({result})}};
  result["description"] =
      verb.description + (verb.timeout.empty() ? "" : "; runs out of time after " + verb.timeout);
  return result;
}

/// The definition that a measurement's limits are written by.
std::string definition_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::length:
      return "length";
    case Dimension::angle:
      return "angle";
    case Dimension::time:
      return "time";
    case Dimension::speed:
      return "speed";
    case Dimension::angular_speed:
      return "angular_speed";
    case Dimension::frequency:
      return "frequency";
    default:
      return "number";
  }
}

/// Schema of a criterion, as evaluation::read_criteria reads it.
json criterion() {
  json names = json::array();
  std::map<std::pair<std::string, bool>, std::vector<std::string>> alike;  // by limits, statistic
  for (const evaluation::Measurement& measurement : evaluation::measurements()) {
    names.push_back({{"const", measurement.name}, {"description", measurement.description}});
    const bool series = static_cast<bool>(measurement.series);
    alike[{definition_of(measurement.dimension), series}].push_back(measurement.name);
  }
  names.push_back(ref("reference"));
  json properties = {{"name", ref("text")}, {"measurement", {{"anyOf", names}}}};
  properties["statistic"] = {
      {"anyOf", json::array({{{"enum", evaluation::statistic_names()}}, ref("reference")})}};
  properties["phase"] = ref("text");
  for (const char* value : {"min", "max", "nominal"}) properties[value] = ref("quantity");
  properties["samples"] = ref("count");
  properties["claim"] = ref("text");
  json result = object(properties, {"name", "measurement"});
  result["anyOf"] = json::array({{{"required", {"min"}}}, {{"required", {"max"}}}});
  result["allOf"] = json::array();
  for (const auto& [kind, measurements] : alike) {
    const auto& [definition, series] = kind;
    json then;
    for (const char* value : {"min", "max", "nominal"}) then["properties"][value] = ref(definition);
    const json statistic = {{"required", {"statistic"}}};
    then.update(series ? statistic : json{{"not", statistic}});
    result["allOf"].push_back(
        {{"if", {{"properties", {{"measurement", {{"enum", measurements}}}}}}}, {"then", then}});
  }
  return result;
}

/// Schema of a figure, as evaluation::read_figures reads it.
json figure() {
  const json texts = list_of(ref("text"));
  const json chart =
      object({{"title", ref("text")},
              {"draw", texts},
              {"statistic", {{"enum", evaluation::statistic_names()}}},
              {"phase", ref("text")},
              {"phases", texts},
              {"over", {{"enum", {"time", "sample"}}}},
              {"criteria", texts},
              {"levels", {{"type", "object"}, {"additionalProperties", ref("quantity")}}}},
             {"draw"});
  return object({{"name", ref("text")},
                 {"caption", ref("text")},
                 {"charts", {{"type", "array"}, {"items", chart}, {"minItems", 1}}}},
                {"name", "charts"});
}

json step() {
  json properties;
  json one_of = json::array();
  for (const auto* table : {&verbs(), &blocks()}) {
    for (const VerbInfo& verb : *table) {
      properties[verb.name] = behind(verb);
      one_of.push_back({{"required", {verb.name}}});
    }
  }
  for (const KeyInfo& key : step_keys()) properties[key.key] = described(key);
  json result = object(properties, {});
  result["oneOf"] = one_of;
  return result;
}

}  // namespace

std::string json_schema() {
  json schema = {{"$schema", "http://json-schema.org/draft-07/schema#"},
                 {"title", "A test procedure of Berth"}};
  schema.update(object_of(procedure_keys()));
  schema["definitions"] = definitions();
  schema["definitions"]["step"] = step();
  schema["definitions"]["criterion"] = criterion();
  schema["definitions"]["figure"] = figure();
  schema["definitions"]["limit"] = object_of(limit_keys());
  return json_text(schema, 2) + "\n";
}

}  // namespace berth::procedures
