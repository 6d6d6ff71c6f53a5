// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/quantity.h"

#include <array>
#include <charconv>
#include <cmath>

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

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

std::string describe(Dimension dimension) {
  switch (dimension) {
    case Dimension::number:
      return "a number such as '0.5'";
    case Dimension::length:
      return "a length such as '5.5 m' or '30 mm'";
    case Dimension::angle:
      return "an angle such as '2 deg' or '0.1 mrad'";
    case Dimension::time:
      return "a time such as '10 s' or '150 ms'";
    case Dimension::speed:
      return "a speed such as '20 mm/s'";
    case Dimension::angular_speed:
      return "an angular speed such as '3 deg/s'";
    case Dimension::acceleration:
      return "an acceleration such as '0.5 m/s^2'";
    case Dimension::angular_acceleration:
      return "an angular acceleration such as '400 deg/s^2'";
    case Dimension::jerk:
      return "a jerk such as '2 m/s^3'";
    case Dimension::frequency:
      return "a frequency such as '100 Hz'";
    case Dimension::mass:
      return "a mass such as '13 kg'";
  }
  return {};
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
