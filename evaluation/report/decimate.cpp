// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/decimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace berth::report {
namespace {

struct Column {
  std::size_t first, least, greatest, last;

  explicit Column(std::size_t i) : first(i), least(i), greatest(i), last(i) {}

  void add(std::size_t i, const std::vector<double>& y) {
    if (y[i] < y[least]) least = i;
    if (y[i] > y[greatest]) greatest = i;
    last = i;
  }

  void put(std::vector<std::size_t>& kept) const {
    std::array<std::size_t, 4> order = {first, least, greatest, last};
    std::sort(order.begin(), order.end());
    for (const std::size_t i : order) {
      if (kept.empty() || kept.back() != i) kept.push_back(i);
    }
  }
};

}  // namespace

std::vector<std::size_t> worth_drawing(const std::vector<double>& x, const std::vector<double>& y,
                                       double low, double high, std::size_t columns) {
  std::vector<std::size_t> kept;
  if (x.size() <= 2 * columns || high <= low) {
    kept.resize(x.size());
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    return kept;
  }
  const double scale = static_cast<double>(columns) / (high - low);
  double current = std::numeric_limits<double>::quiet_NaN();
  std::optional<Column> column;
  const auto close = [&] {
    if (column) column->put(kept);
    column.reset();
  };
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(y[i])) {
      close();
      // One break is as good as many.
      if (kept.empty() || std::isfinite(y[kept.back()])) kept.push_back(i);
      continue;
    }
    const double here = std::floor((x[i] - low) * scale);
    if (column && here == current) {
      column->add(i, y);
      continue;
    }
    close();
    current = here;
    column.emplace(i);
  }
  close();
  return kept;
}

}  // namespace berth::report
