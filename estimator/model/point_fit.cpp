// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/point_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "estimator/model/normal_sums.h"
#include "estimator/model/turned_points.h"

namespace berth::estimator {

Pose lay_points(const ClosestPointGrid& grid, std::span<const Vector3d> points,
                const Pose& to_model, double first_gate, double last_gate, int iterations) {
  Pose pose = to_model;
  TurnedPoints turned(points.size());
  for (int i = 0; i < iterations; ++i) {
    const double share = iterations > 1 ? static_cast<double>(i) / (iterations - 1) : 1;
    const double gate = first_gate * std::pow(last_gate / first_gate, share);
    const std::size_t used = turned.turn(grid, points, pose);
    if (used < 6) return pose;
    NormalSums sums;
    double inertia = 0;
    for (std::size_t from = 0; from < used; from += TurnedPoints::lanes) {
      const Four3 arm = turned.arms(from);
      const Four3 place = turned.places(from);
      const ClosestPointGrid::FourMatches match = grid.refined(place, turned.voxels_at(from));
      const Four3 off = match.point - place;
      const Four distance = root(off.dot(off));
      // Off the rim of a panel the way back is not along its normal.
      const Four3 along = chosen(distance > 1e-6, off / distance, match.normal);
      const Four ratio = distance / gate;
      const Four spread = 1 + ratio * ratio;
      Four weight = 1 / (spread * spread);
      for (std::size_t n = 0; n < TurnedPoints::lanes; ++n) {
        if (from + n >= used) weight[n] = 0;
      }
      sums.add(along, arm.cross(along), weight, weight * distance);
      const Four pull = weight * arm.dot(arm);
      for (std::size_t n = 0; n < TurnedPoints::lanes; ++n) inertia += pull[n];
    }
    Matrix6d a = sums.products();
    // What no surface holds stays where it is.
    const double trace = a.diagonal().head<3>().sum();
    a.diagonal().head<3>().array() += 1e-3 * trace + 1e-12;
    a.diagonal().tail<3>().array() += 1e-3 * inertia + 1e-12;
    pose = perturbed(pose, a.ldlt().solve(sums.residuals()));
  }
  return pose;
}

}  // namespace berth::estimator
