// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "common/clouds/cloud.h"

namespace berth::clouds {

/// One column of a table.
struct Column {
  int index = -1;    ///< -1: there is none
  std::string name;  ///< as the file has it
  double scale = 1;  ///< its unit in m

  explicit operator bool() const { return index >= 0; }
};

/// The columns of a table that a cloud is made of.
struct Columns {
  Column x, y, z;
  Column sigma;          ///< of the range
  Column return_number;  ///< 1, 2 ... of its beam
  Column time;
  std::optional<double> us_per_time;  ///< from the name of the time's column

  bool has_point() const { return x && y && z; }
  /// Without names: x y z are the first three.
  static Columns first_three();
};

/// Looks for x, y, z (or one of the spellings that exports use, as "Points:0"), a time, a range
/// sigma and a return_number. Case, quotes and blanks do not count; a unit may follow the
/// name: "x (mm)", "y [m]", "time_us". Other names are ignored. where: for messages, "file:line" or
/// "file".
/// @throws InputError when a coordinate's name is there twice, or a length's unit is not known.
Columns find_columns(const std::vector<std::string>& names, const std::string& where);

/// One row of a cloud, as the file has it; NaN for what is missing or no number.
struct CloudRow {
  Vector3d point = Vector3d::Zero();
  double sigma = std::numeric_limits<double>::quiet_NaN();
  double time = std::numeric_limits<double>::quiet_NaN();
  double return_number = 1;
};

/// A file's rows, and what their columns hold.
struct Table {
  Columns columns;
  std::vector<CloudRow> rows;
  std::vector<std::string> notes;
};

/// Makes a cloud of rows: what every format has in common.
class CloudBuilder {
 public:
  CloudBuilder(const Columns& columns, const CloudOptions& options)
      : columns_(columns), options_(options) {}

  /// Takes a row in as a hit, or counts why not.
  void add(const CloudRow& row);
  /// An empty beam; direction: unit, nullptr where it is unknown.
  void add_empty(const Vector3d* direction);
  void note(std::string text) { cloud_.notes.push_back(std::move(text)); }
  /// Empty places of an organised cloud were beams.
  void take_not_finite_as_empty();

  /// Decides, for all rows alike, whether times and sigmas are usable.
  Cloud finish();

 private:
  void set_times();
  void set_sigmas();

  const Columns& columns_;
  const CloudOptions& options_;
  Cloud cloud_;
  std::vector<double> times_;  ///< of the hits, as the file has them
};

}  // namespace berth::clouds
