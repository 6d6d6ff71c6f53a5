// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <vector>

#include "estimator/plan/scan_planner.h"
#include "test/catch.h"

namespace berth::estimator {

/// The surface is the mesh, and most beams are planned.
inline const PlannerOptions planner_options = [] {
  PlannerOptions options;
  options.bare_surface_sigma_m = 0;
  options.spread_share = 0.1;
  return options;
}();

inline int beams_of(const std::vector<Window>& windows) {
  int sum = 0;
  for (const Window& w : windows) sum += w.count;
  return sum;
}

/// Each window has beams, and lies inside the field of view.
inline void check_in_view(const std::vector<Window>& windows, const FieldOfView& field = {}) {
  for (const Window& w : windows) {
    CHECK(std::abs(w.azimuth) + 0.5 * w.width <= 0.5 * field.width + 1e-9);
    CHECK(std::abs(w.elevation) + 0.5 * w.height <= 0.5 * field.height + 1e-9);
    CHECK(w.width > 0);
    CHECK(w.height > 0);
    CHECK(w.count > 0);
  }
}

}  // namespace berth::estimator
