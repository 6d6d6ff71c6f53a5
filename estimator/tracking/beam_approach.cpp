// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_approach.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/model/normal_sums.h"

namespace berth::estimator {

Pose approach(const TargetModel& model, std::span<const Vector3d> points, const Pose& start,
              const BeamApproachOptions& options) {
  constexpr std::size_t least_points = 6;
  struct Pair {
    Vector3d point, normal, across;  // model frame; across: along the face, longer than nothing
    double out, beside, squared;     // of the face, beyond its border, m
  };
  std::vector<Pair> pairs;
  std::vector<double> distances;
  pairs.reserve(points.size());
  distances.reserve(points.size());
  // The voxel's triangle is the nearest to its centre only: so far the border means nothing.
  const double blur = model.grid.cell();
  double scale = options.widest_m;
  Pose pose = start;
  for (int i = 0; i < options.max_iterations; ++i) {
    const Pose to_model = pose.inverse();
    const Matrix3d rotation = to_model.rotation.toRotationMatrix();
    pairs.clear();
    distances.clear();
    ClosestPointGrid::Match found;
    for (const Vector3d& p : points) {
      const Vector3d q = rotation * p + to_model.position;
      if (!model.grid.refined(q, found)) continue;
      const Vector3d away = q - found.point;
      const double out = found.normal.dot(away);
      Vector3d across = away - out * found.normal;
      const double length = across.norm();
      const double beside = std::max(0.0, length - blur);
      if (beside > 0) across /= length;
      const double squared = out * out + beside * beside;
      pairs.push_back({q, found.normal, across, out, beside, squared});
      if (squared < scale * scale) distances.push_back(squared);
    }
    if (distances.size() < least_points) break;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    scale =
        std::clamp(options.scale_sigmas * 1.4826 * std::sqrt(*middle), options.narrowest_m, scale);
    NormalSums sums(false);
    for (const Pair& p : pairs) {
      const double rest = 1 - p.squared / (scale * scale);
      if (rest <= 0) continue;
      const double weight = rest * rest;  // Tukey
      sums.add(p.normal, p.point.cross(p.normal), weight, -weight * p.out, 0);
      if (p.beside > 0) {
        sums.add(p.across, p.point.cross(p.across), weight, -weight * p.beside, 0);
      }
    }
    sums.flush();
    Matrix6d a = sums.products(0);
    // What nothing holds stays where it is.
    a.diagonal().array() +=
        1e-3 * static_cast<double>(distances.size()) *
        (Vector6d() << 1, 1, 1, Vector3d::Constant(model.radius * model.radius)).finished().array();
    const Vector6d motion = a.ldlt().solve(sums.residuals(0));  // of the points, model frame
    pose = pose * perturbed(Pose{}, motion).inverse();
    if (motion.head<3>().norm() + model.radius * motion.tail<3>().norm() < options.stop_m) break;
  }
  return pose;
}

}  // namespace berth::estimator
