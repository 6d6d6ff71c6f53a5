// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace berth::clouds {

/// One column of a table.
struct Column {
  int index = -1;    ///< -1: there is none
  std::string name;  ///< as the file has it
  double scale = 1;  ///< its unit in m

  explicit operator bool() const { return index >= 0; }
};

/// Which columns of a table hold what a cloud is made of.
struct Columns {
  Column x, y, z;
  Column sigma;          ///< of the range
  Column return_number;  ///< 1, 2 ... of its beam
  Column time;
  std::optional<double> us_per_time;  ///< the unit that the time's name says

  bool has_point() const { return x && y && z; }
  /// Without names: x y z are the first three.
  static Columns first_three();
};

/// Looks for x, y, z (or one of the spellings that exports use, as "Points:0"), a time, a range
/// sigma and a return_number. Case, quotes and blanks do not count; a unit may stand behind the
/// name: "x (mm)", "y [m]", "time_us". Other names are ignored. where: for messages, "file:line" or
/// "file".
/// @throws InputError when a coordinate's name is there twice, or a length's unit is not known.
Columns find_columns(const std::vector<std::string>& names, const std::string& where);

}  // namespace berth::clouds
