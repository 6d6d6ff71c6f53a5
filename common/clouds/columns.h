// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth::clouds {

/// Which columns of a table hold what a cloud is made of; -1: none does.
struct Columns {
  int x = -1;
  int y = -1;
  int z = -1;
  int time = -1;
  int sigma = -1;
  double us_per_time = 1;  ///< unit of the time column

  bool has_point() const { return x >= 0 && y >= 0 && z >= 0; }
};

/// Looks for x, y, z; time or timestamp (s), utime or time_us (us); sigma or range_sigma, in any
/// case. Other names are ignored; of two alike the first counts.
Columns find_columns(const std::vector<std::string>& names);

}  // namespace berth::clouds
