// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/error.h"
#include "common/core/yaml_text.h"
#include "procedures/language/parameters.h"
#include "procedures/language/procedure.h"

namespace berth::procedures {
namespace {

std::string shortest(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

/// Values in the unit of `from`.
std::vector<YamlNode> read_range(Config& axis) {
  const std::string from = axis.text("from");
  const auto dimension = dimension_of(from);
  if (!dimension) throw axis.error("from", "found '" + from + "', expected a quantity");
  const double first = parse_quantity(from, *dimension);
  const double last = axis.quantity("to", *dimension);
  const double step = axis.quantity("step", *dimension, above(0));  // from and to define the sign
  axis.finish();
  const double count = std::floor(std::abs((last - first) / step) + 1e-9);
  if (count >= max_steps) {
    throw axis.error("step", "gives more than " + std::to_string(max_steps) + " values");
  }
  const std::string unit =
      from.substr(std::min(from.find_first_not_of("-+0123456789.eE \t"), from.size()));
  const double unit_si = parse_quantity("1 " + unit, *dimension);
  std::vector<YamlNode> values;
  for (int i = 0; i <= static_cast<int>(count); ++i) {
    const double value = first + i * std::copysign(step, last - first);
    values.emplace_back(shortest(value / unit_si) + (unit.empty() ? "" : " " + unit));
  }
  return values;
}

}  // namespace

std::vector<SweepAxis> read_axes(Config& sweep) {
  std::vector<SweepAxis> axes;
  for (const std::string& name : sweep.keys()) {
    if (name == "steps") continue;
    if (!is_name(name)) throw sweep.error(name, "is not a name");
    SweepAxis axis{name, {}};
    const YamlNode node = sweep.raw(name);
    axis.values = node.items();
    if (node.is_map()) {
      Config range = sweep.section(name);
      axis.values = read_range(range);
    }
    for (const YamlNode& value : axis.values) {
      if (plain_text(value).empty() || value.is_map())
        throw sweep.error(name, "found an empty value");
    }
    if (axis.values.empty()) {
      throw sweep.error(name, "expected a list of values, or {from: ..., to: ..., step: ...}");
    }
    axes.push_back(std::move(axis));
  }
  if (axes.empty()) throw sweep.error("steps", "expected a name to sweep in addition to 'steps'");
  return axes;
}

std::set<std::string> swept_names(const YamlNode& node) {
  std::set<std::string> names;
  for (const YamlNode& item : node.items()) names.merge(swept_names(item));
  for (const auto& [key, value] : node.entries()) {
    names.merge(swept_names(value));
    if (key.text() != "sweep") continue;
    for (const auto& axis : value.entries()) names.insert(axis.first.text());
  }
  names.erase("steps");
  return names;
}

std::vector<Pose> read_poses(Config& config, const std::string& key) {
  const YamlNode list = config.raw(key);
  if (!list.is_list() || list.size() == 0) {
    throw config.error(key, "expected a list of poses [x, y, z, w, p, r]");
  }
  std::vector<Pose> poses;
  for (const YamlNode& item : list.items()) {
    Xyzwpr values{};
    if (!item.is_list() || item.size() != values.size()) {
      throw config.error(
          key, "found '" + plain_text(item) + "', expected [x, y, z, w, p, r] in mm and degrees");
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      try {
        values[i] = parse_quantity(item.items()[i].text(), Dimension::number);
      } catch (const InputError& e) {
        throw config.error(key, e.what());
      }
    }
    poses.push_back(pose_from_xyzwpr(values));
  }
  return poses;
}

}  // namespace berth::procedures
