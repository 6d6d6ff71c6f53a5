// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/columns.h"

#include <algorithm>
#include <cctype>

namespace berth::clouds {

Columns find_columns(const std::vector<std::string>& names) {
  Columns columns;
  for (int i = 0; i < static_cast<int>(names.size()); ++i) {
    std::string name = names[static_cast<std::size_t>(i)];
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const auto take = [i](int& column) {
      if (column < 0) column = i;
      return column == i;
    };
    if (name == "x") take(columns.x);
    if (name == "y") take(columns.y);
    if (name == "z") take(columns.z);
    if (name == "sigma" || name == "range_sigma") take(columns.sigma);
    if ((name == "time" || name == "timestamp") && take(columns.time)) columns.us_per_time = 1e6;
    if ((name == "utime" || name == "time_us") && take(columns.time)) columns.us_per_time = 1;
  }
  return columns;
}

}  // namespace berth::clouds
