// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "common/clouds/cloud.h"
#include "common/clouds/columns.h"

namespace berth::clouds {

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
  /// An empty beam; direction: unit, nullptr where nothing tells it.
  void add_empty(const Vector3d* direction);
  void note(std::string text) { cloud_.notes.push_back(std::move(text)); }
  /// Empty places of an organised cloud were beams.
  void take_not_finite_as_empty();

  /// Decides what times and sigmas are worth, for all rows alike.
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
