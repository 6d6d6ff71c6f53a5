// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/sweep.h"

#include <cmath>
#include <cstdio>
#include <regex>

#include "common/core/error.h"
#include "common/core/positive.h"
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
std::vector<std::string> read_range(Config& axis) {
  const std::string from = axis.text("from");
  const auto dimension = dimension_of(from);
  if (!dimension) throw axis.error("from", "found '" + from + "', expected a quantity");
  const double first = parse_quantity(from, *dimension);
  const double last = axis.quantity("to", *dimension);
  const double step = positive(axis, "step", *dimension);  // from and to say which way
  axis.finish();
  const double count = std::floor(std::abs((last - first) / step) + 1e-9);
  if (count >= most_steps) {
    throw axis.error("step", "gives more than " + std::to_string(most_steps) + " values");
  }
  const std::string unit = std::regex_replace(from, std::regex(R"(^\s*[-+0-9.eE]*[0-9.]\s*)"), "");
  const double unit_si = parse_quantity("1 " + unit, *dimension);
  std::vector<std::string> values;
  for (int i = 0; i <= static_cast<int>(count); ++i) {
    const double value = first + i * std::copysign(step, last - first);
    values.push_back(shortest(value / unit_si) + (unit.empty() ? "" : " " + unit));
  }
  return values;
}

}  // namespace

std::string text_of(const YAML::Node& node) {
  if (!node.IsSequence()) return node.IsScalar() ? node.Scalar() : "";
  std::string list;
  for (const auto& item : node) list += (list.empty() ? "" : ", ") + text_of(item);
  return "[" + list + "]";
}

std::vector<SweepAxis> read_axes(Config& sweep) {
  static const std::regex word("[A-Za-z_][A-Za-z0-9_]*");
  std::vector<SweepAxis> axes;
  for (const std::string& name : sweep.keys()) {
    if (name == "steps") continue;
    if (!std::regex_match(name, word)) throw sweep.error(name, "is not a name");
    SweepAxis axis{name, {}};
    const YAML::Node node = sweep.raw(name);
    if (node.IsMap()) {
      Config range = sweep.section(name);
      axis.values = read_range(range);
    } else if (node.IsSequence()) {
      for (const auto& item : node) axis.values.push_back(text_of(item));
    }
    for (const std::string& value : axis.values) {
      if (value.empty()) throw sweep.error(name, "found an empty value");
    }
    if (axis.values.empty()) {
      throw sweep.error(name, "expected a list of values, or {from: ..., to: ..., step: ...}");
    }
    axes.push_back(std::move(axis));
  }
  if (axes.empty()) throw sweep.error("steps", "expected a name to sweep beside 'steps'");
  return axes;
}

std::set<std::string> swept_names(const YAML::Node& node) {
  std::set<std::string> names;
  const auto add_below = [&names](const YAML::Node& below) {
    for (const std::string& name : swept_names(below)) names.insert(name);
  };
  if (node.IsSequence()) {
    for (const auto& item : node) add_below(item);
  }
  if (!node.IsMap()) return names;
  for (const auto& item : node) {
    add_below(item.second);
    if (item.first.Scalar() != "sweep" || !item.second.IsMap()) continue;
    for (const auto& axis : item.second) names.insert(axis.first.Scalar());
  }
  names.erase("steps");
  return names;
}

std::vector<Pose> read_poses(Config& config, const std::string& key) {
  const YAML::Node list = config.raw(key);
  if (!list || !list.IsSequence() || list.size() == 0) {
    throw config.error(key, "expected a list of poses [x, y, z, w, p, r]");
  }
  std::vector<Pose> poses;
  for (const auto& item : list) {
    Xyzwpr values{};
    if (!item.IsSequence() || item.size() != values.size()) {
      throw config.error(
          key, "found '" + text_of(item) + "', expected [x, y, z, w, p, r] in mm and degrees");
    }
    for (std::size_t i = 0; i < values.size(); ++i) {
      try {
        values[i] = parse_quantity(item[i].Scalar(), Dimension::number);
      } catch (const InputError& e) {
        throw config.error(key, e.what());
      }
    }
    poses.push_back(pose_from_xyzwpr(values));
  }
  return poses;
}

}  // namespace berth::procedures
