// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/point_fit.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "estimator/model/normal_sums.h"

namespace berth::estimator {

Pose lay_points(const ClosestPointGrid& grid, std::span<const Vector3d> points,
                const Pose& to_model, double first_gate, double last_gate, int iterations) {
  Pose pose = to_model;
  std::vector<Vector3d> arms(points.size());
  for (int i = 0; i < iterations; ++i) {
    const double share = iterations > 1 ? static_cast<double>(i) / (iterations - 1) : 1;
    const double gate = first_gate * std::pow(last_gate / first_gate, share);
    const Matrix3d rotation = pose.rotation.toRotationMatrix();
    for (std::size_t n = 0; n < points.size(); ++n) {
      arms[n] = rotation * points[n];
      grid.fetch(arms[n] + pose.position);
    }
    NormalSums sums(false);
    double inertia = 0;
    int used = 0;
    for (const Vector3d& arm : arms) {
      ClosestPointGrid::Match match;
      if (!grid.refined(arm + pose.position, match)) continue;
      const Vector3d off = match.point - (arm + pose.position);
      const double distance = off.norm();
      // Off the rim of a panel the way back is not along its normal.
      const Vector3d along = distance > 1e-6 ? Vector3d(off / distance) : match.normal;
      const double ratio = distance / gate;
      const double weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
      sums.add(along, arm.cross(along), weight, weight * distance, 0);
      inertia += weight * arm.squaredNorm();
      ++used;
    }
    if (used < 6) return pose;
    sums.flush();
    Matrix6d a = sums.products(0);
    // What no surface holds stays where it is.
    const double trace = a.diagonal().head<3>().sum();
    a.diagonal().head<3>().array() += 1e-3 * trace + 1e-12;
    a.diagonal().tail<3>().array() += 1e-3 * inertia + 1e-12;
    pose = perturbed(pose, a.ldlt().solve(sums.residuals(0)));
  }
  return pose;
}

}  // namespace berth::estimator
