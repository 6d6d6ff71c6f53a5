// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/ranges/view_moments.h"

#include <cmath>

namespace berth::estimator {

std::vector<ViewMoments> view_moments(const TargetModel& model) {
  std::vector<ViewMoments> views;
  for (int i = 0; i < direction_count; ++i) {
    ViewMoments view;
    view.to_viewer = view_directions()[static_cast<std::size_t>(i)];
    double sum = 0;
    Matrix3d second = Matrix3d::Zero();
    for (const SurfaceSample& s : model.surface.samples) {
      if (!s.visible_from.contains(i)) continue;
      const double weight = std::abs(s.normal.cast<double>().dot(view.to_viewer));
      const Vector3d p = s.position.cast<double>();
      view.centroid += weight * p;
      second += weight * p * p.transpose();
      sum += weight;
    }
    if (sum <= 0) continue;
    view.centroid /= sum;
    view.scatter = second / sum - view.centroid * view.centroid.transpose();
    views.push_back(view);
  }
  return views;
}

}  // namespace berth::estimator
