// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/parameter.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "common/core/error.h"
#include "common/core/pose.h"
#include "common/core/yaml_text.h"

namespace berth::campaigns {
namespace {

using Kind = Draw::Kind;
constexpr char any_attitude[] = "any attitude";
constexpr char distributions[] =
    "a distribution: {uniform: [LOW, HIGH]}, {log_uniform: [LOW, HIGH]}, {normal: [MEAN, SIGMA]}, "
    "{choice: [A, B]}, or 'any attitude'";

/// Nine digits: trial and result line get the same value.
std::string text_of(double value, const std::string& unit) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return unit.empty() ? text : std::string(text) + " " + unit;
}

Draw value_of(const YamlNode& node, const Config& config, const std::string& key) {
  if (node.text().empty()) throw config.error(key, "expected a value");
  Draw one;
  one.texts = {node.text()};
  return one;
}

/// The two numbers of a distribution, both in one unit.
void read_pair(const YamlNode& node, const Config& config, const std::string& key,
               const std::string& kind, Draw& into) {
  const auto wrong = [&](const std::string& what) {
    return config.error(
        key, kind + ": " + what + ", expected two numbers in one unit, as [5 mm, 10 mm]");
  };
  if (!node.is_list() || node.size() != 2) throw wrong("found no list of two");
  const auto a = quantity_of(node.items()[0].text());
  const auto b = quantity_of(node.items()[1].text());
  if (!a || !b || a->unit != b->unit) throw wrong("found " + plain_text(node));
  into.a = a->value;
  into.b = b->value;
  into.unit = a->unit;
}

Draw distribution_of(const YamlNode& node, const Config& config, const std::string& key) {
  if (node.size() != 1) throw config.error(key, std::string("expected ") + distributions);
  const auto& [name, value] = node.entries().front();
  const std::string& kind = name.text();
  Draw one;
  if (kind == "choice") {
    one.kind = Kind::choice;
    if (!value.is_list() || value.size() == 0) {
      throw config.error(key, "choice: expected a list of values");
    }
    for (const YamlNode& item : value.items()) {
      one.texts.push_back(value_of(item, config, key).texts[0]);
    }
    return one;
  }
  if (kind == "uniform") {
    one.kind = Kind::uniform;
  } else if (kind == "normal") {
    one.kind = Kind::normal;
  } else if (kind == "log_uniform") {
    one.kind = Kind::log_uniform;
  } else {
    throw config.error(key, "found '" + kind + "', expected " + distributions);
  }
  read_pair(value, config, key, kind, one);
  if (one.kind == Kind::normal && one.b < 0) {
    throw config.error(key, "normal: found a negative sigma");
  }
  if (one.kind != Kind::normal && one.a > one.b) {
    throw config.error(key, kind + ": the low end is above the high end");
  }
  if (one.kind == Kind::log_uniform && one.a <= 0) {
    throw config.error(key, "log_uniform: expected ends above zero");
  }
  return one;
}

/// A value, a distribution, or where `lists` a list of either.
std::vector<Draw> draws_of(const YamlNode& node, const Config& config, const std::string& key,
                           bool may_be_drawn, bool& is_list) {
  const auto one = [&](const YamlNode& item) {
    if (item.is_map() && may_be_drawn) return distribution_of(item, config, key);
    Draw value = value_of(item, config, key);
    if (value.texts[0] != any_attitude) return value;
    if (!may_be_drawn) throw config.error(key, "'any attitude' is drawn, expected a value");
    value.kind = Kind::attitude;
    return value;
  };
  std::vector<Draw> draws;
  is_list = node.is_list();
  if (!is_list) return {one(node)};
  for (const YamlNode& item : node.items()) draws.push_back(one(item));
  if (draws.empty()) throw config.error(key, "found an empty list");
  return draws;
}

Parameter parameter_at(Config& section, const std::string& key) {
  Parameter parameter;
  parameter.name = key;
  for (const auto& [name, value] : section.node().entries()) {
    if (name.text() == key) parameter.line = name.line();
  }
  return parameter;
}

template <class Read>
std::vector<Parameter> read_section(Config& manifest, const std::string& name,
                                    const std::string& kind, const Read& read) {
  std::vector<Parameter> parameters;
  Config section = manifest.optional_section(name);
  for (const auto& [key, value] : section.named_values(kind)) {
    Parameter parameter = parameter_at(section, key);
    read(section, value, parameter);
    parameters.push_back(std::move(parameter));
  }
  return parameters;
}

std::string drawn_text(const Draw& from, Random& random, std::optional<Quaterniond>& attitude) {
  switch (from.kind) {
    case Kind::value:
      return from.texts.front();
    case Kind::choice:
      return from.texts[random.bits() % from.texts.size()];
    case Kind::uniform:
      return text_of(random.uniform(from.a, from.b), from.unit);
    case Kind::normal:
      return text_of(from.a + random.normal(from.b), from.unit);
    case Kind::log_uniform:
      return text_of(std::exp(random.uniform(std::log(from.a), std::log(from.b))), from.unit);
    case Kind::attitude:
      break;
  }
  const Xyzwpr drawn = xyzwpr_from_pose({Vector3d::Zero(), random.rotation()});
  std::string text;
  Xyzwpr written{};
  for (std::size_t i = 3; i < 6; ++i) {
    const std::string angle = text_of(drawn[i], "");
    written[i] = std::strtod(angle.c_str(), nullptr);
    text += (i == 3 ? "" : ", ") + angle;
  }
  attitude = pose_from_xyzwpr(written).rotation;
  return text;
}

}  // namespace

std::optional<Quantity> quantity_of(const std::string& text) {
  char* end = nullptr;
  Quantity quantity;
  quantity.value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || !std::isfinite(quantity.value)) return std::nullopt;
  std::string unit = end;
  unit.erase(0, unit.find_first_not_of(' '));
  if (unit.find_first_of(" ,[]") != std::string::npos) return std::nullopt;
  quantity.unit = unit;
  return quantity;
}

DrawnValue draw(const Parameter& parameter, std::size_t which, Random& random) {
  DrawnValue value;
  const auto& draws = parameter.values.at(which);
  bool is_list = parameter.is_list;
  for (std::size_t i = 0; i < draws.size(); ++i) {
    is_list = is_list || draws[i].kind == Kind::attitude;
    const std::string text = drawn_text(draws[i], random, value.attitude);
    const bool item = parameter.is_list && draws[i].kind != Kind::attitude;
    value.text += (i == 0 ? "" : ", ") + (item ? flow_text(YamlNode(text)) : text);
  }
  if (is_list) value.text = "[" + value.text + "]";
  return value;
}

std::vector<Parameter> read_grid(Config& manifest) {
  return read_section(
      manifest, "grid", "list of values",
      [](Config& section, const YamlNode& node, Parameter& into) {
        if (!node.is_list() || node.size() == 0) {
          throw section.error(into.name, "expected a list of the values that it takes");
        }
        for (const YamlNode& item : node.items()) {
          into.values.push_back(draws_of(item, section, into.name, false, into.is_list));
        }
      });
}

std::vector<Parameter> read_drawn(Config& manifest) {
  return read_section(
      manifest, "draw", "distribution", [](Config& section, const YamlNode& node, Parameter& into) {
        into.values = {draws_of(node, section, into.name, true, into.is_list)};
        for (const Draw& one : into.values.front()) {
          if (one.kind != Kind::value) return;
        }
        throw section.error(
            into.name,
            std::string("is always the same: put it under 'set', or give ") + distributions);
      });
}

std::vector<Parameter> read_fixed(Config& manifest) {
  return read_section(manifest, "set", "value",
                      [](Config& section, const YamlNode& node, Parameter& into) {
                        into.values = {draws_of(node, section, into.name, false, into.is_list)};
                      });
}

}  // namespace berth::campaigns
