// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/residuals.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace berth::testbed {
namespace {

void note(std::vector<CalibrationResidual>& list, const std::string& kind, double size,
          const std::string& where) {
  auto found = std::find_if(list.begin(), list.end(),
                            [&](const CalibrationResidual& r) { return r.kind == kind; });
  if (found == list.end()) {
    list.push_back({kind, 0, 0, -1, ""});
    found = std::prev(list.end());
  }
  ++found->count;
  found->rms += size * size;
  if (size <= found->worst) return;
  found->worst = size;
  found->where = where;
}

}  // namespace

std::vector<CalibrationResidual> summarised(const std::vector<MeasurementResidual>& residuals) {
  std::vector<CalibrationResidual> list;
  for (const MeasurementResidual& residual : residuals) {
    note(list, residual.kind + ", position", residual.position, residual.where);
    if (residual.attitude) {
      note(list, residual.kind + ", attitude", *residual.attitude, residual.where);
    }
  }
  for (CalibrationResidual& residual : list) {
    residual.rms = std::sqrt(residual.rms / static_cast<double>(residual.count));
  }
  return list;
}

}  // namespace berth::testbed
