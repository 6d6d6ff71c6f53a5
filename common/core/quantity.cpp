// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/quantity.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "common/core/error.h"
#include "common/core/pose.h"

namespace berth {
namespace {

struct Unit {
  Dimension dimension;
  std::string_view name;
  double si;
};

constexpr double deg = radians(1.0);

constexpr std::array units{
    Unit{Dimension::number, "", 1},
    Unit{Dimension::number, "%", 1e-2},
    Unit{Dimension::length, "m", 1},
    Unit{Dimension::length, "mm", 1e-3},
    Unit{Dimension::length, "cm", 1e-2},
    Unit{Dimension::length, "um", 1e-6},
    Unit{Dimension::length, "km", 1e3},
    Unit{Dimension::angle, "deg", deg},
    Unit{Dimension::angle, "rad", 1},
    Unit{Dimension::angle, "mrad", 1e-3},
    Unit{Dimension::angle, "urad", 1e-6},
    Unit{Dimension::time, "s", 1},
    Unit{Dimension::time, "ms", 1e-3},
    Unit{Dimension::time, "us", 1e-6},
    Unit{Dimension::time, "ns", 1e-9},
    Unit{Dimension::time, "min", 60},
    Unit{Dimension::time, "h", 3600},
    Unit{Dimension::speed, "m/s", 1},
    Unit{Dimension::speed, "mm/s", 1e-3},
    Unit{Dimension::speed, "cm/s", 1e-2},
    Unit{Dimension::angular_speed, "deg/s", deg},
    Unit{Dimension::angular_speed, "rad/s", 1},
    Unit{Dimension::acceleration, "m/s^2", 1},
    Unit{Dimension::acceleration, "mm/s^2", 1e-3},
    Unit{Dimension::angular_acceleration, "deg/s^2", deg},
    Unit{Dimension::angular_acceleration, "rad/s^2", 1},
    Unit{Dimension::jerk, "m/s^3", 1},
    Unit{Dimension::jerk, "mm/s^3", 1e-3},
    Unit{Dimension::frequency, "Hz", 1},
    Unit{Dimension::frequency, "kHz", 1e3},
    Unit{Dimension::mass, "kg", 1},
    Unit{Dimension::mass, "g", 1e-3},
};

/// Its name, and an example behind "such as".
struct DimensionWords {
  Dimension dimension;
  const char* name;
  const char* examples;
};

constexpr std::array dimension_words{
    DimensionWords{Dimension::number, "number", "'0.5'"},
    DimensionWords{Dimension::length, "length", "'5.5 m' or '30 mm'"},
    DimensionWords{Dimension::angle, "angle", "'2 deg' or '0.1 mrad'"},
    DimensionWords{Dimension::time, "time", "'10 s' or '150 ms'"},
    DimensionWords{Dimension::speed, "speed", "'20 mm/s'"},
    DimensionWords{Dimension::angular_speed, "angular speed", "'3 deg/s'"},
    DimensionWords{Dimension::acceleration, "acceleration", "'0.5 m/s^2'"},
    DimensionWords{Dimension::angular_acceleration, "angular acceleration", "'400 deg/s^2'"},
    DimensionWords{Dimension::jerk, "jerk", "'2 m/s^3'"},
    DimensionWords{Dimension::frequency, "frequency", "'100 Hz'"},
    DimensionWords{Dimension::mass, "mass", "'13 kg'"},
};

const DimensionWords& words_of(Dimension dimension) {
  return dimension_words[static_cast<std::size_t>(dimension)];
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

std::string name_of(Dimension dimension) { return words_of(dimension).name; }

std::string describe(Dimension dimension) {
  const std::string name = name_of(dimension);
  return (name.front() == 'a' ? "an " : "a ") + name + " such as " + words_of(dimension).examples;
}

std::vector<std::string> unit_names(Dimension dimension) {
  std::vector<std::string> names;
  for (const Unit& unit : units) {
    if (unit.dimension == dimension) names.emplace_back(unit.name);
  }
  return names;
}

std::string text_of(double value, Dimension dimension) {
  std::string shortest;
  for (const Unit& unit : units) {
    if (unit.dimension != dimension || unit.name.substr(0, 2) == "cm") continue;
    char text[64];
    std::snprintf(text, sizeof text, unit.name.empty() ? "%.10g" : "%.10g ", value / unit.si);
    const std::string whole = text + std::string(unit.name);
    if (shortest.empty() || whole.size() < shortest.size()) shortest = whole;
  }
  return shortest;
}

std::optional<double> find_unit(std::string_view name, Dimension dimension) {
  for (const Unit& unit : units) {
    if (unit.dimension == dimension && unit.name == name) return unit.si;
  }
  return std::nullopt;
}

double parse_quantity(std::string_view text, Dimension dimension) {
  const std::string_view whole = trimmed(text);
  std::string_view digits = whole;
  const bool plus = !digits.empty() && digits.front() == '+';
  if (plus) digits.remove_prefix(1);
  const bool two_signs = plus && digits.substr(0, 1) == "-";
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const auto used = static_cast<std::size_t>(end - digits.data());
  const std::string_view name = trimmed(digits.substr(used));
  const auto complain = [&] {
    return InputError("found '" + std::string(whole) + "', expected " + describe(dimension));
  };
  const std::optional<double> unit = find_unit(name, dimension);
  if (error != std::errc() || two_signs || !unit || !std::isfinite(value * *unit)) throw complain();
  return value * *unit;
}

}  // namespace berth
