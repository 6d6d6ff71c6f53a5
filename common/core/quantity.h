// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace berth {

/// Physical dimensions that configuration and procedures know.
enum class Dimension {
  number,                ///< no unit; "%" allowed
  length,                ///< m, mm, cm, um, km
  angle,                 ///< rad, mrad, urad, deg
  time,                  ///< s, ms, us, min, h
  speed,                 ///< m/s, mm/s, cm/s
  angular_speed,         ///< rad/s, deg/s
  acceleration,          ///< m/s^2, mm/s^2
  angular_acceleration,  ///< rad/s^2, deg/s^2
  jerk,                  ///< m/s^3, mm/s^3
  frequency,             ///< Hz, kHz
  mass,                  ///< kg, g
};

/// The value in SI units of text such as "20 mm/s".
/// @throws InputError that names the expected units.
double parse_quantity(std::string_view text, Dimension dimension);

/// Reads as the value, to ten digits, in the unit that makes it shortest: "0.1 mrad".
std::string text_of(double value, Dimension dimension);

/// "length", "angular speed".
std::string name_of(Dimension dimension);

/// "a length such as '5.5 m'": for error messages and help.
std::string describe(Dimension dimension);

/// Size of the unit of this name in SI units; nothing where the dimension has none of that name.
std::optional<double> find_unit(std::string_view name, Dimension dimension);
/// "m", "mm" ...; of a number "" and "%".
std::vector<std::string> unit_names(Dimension dimension);

}  // namespace berth
