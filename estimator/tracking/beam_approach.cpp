// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_approach.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "estimator/model/normal_sums.h"
#include "estimator/model/turned_points.h"

namespace berth::estimator {

Pose approach(const TargetModel& model, std::span<const Vector3d> points, const Pose& start,
              const BeamApproachOptions& options) {
  constexpr std::size_t least_points = 6;
  struct Pairs {
    Four3 point, normal, across;  // model frame; across: along the face, longer than nothing
    Four out, beside, squared;    // of the face, beyond its border, m
  };
  std::vector<Pairs> pairs;
  std::vector<double> distances;
  pairs.reserve(points.size() / TurnedPoints::lanes + 1);
  distances.reserve(points.size());
  // The voxel's triangle is the nearest to its centre only: so far the border means nothing.
  const Four blur = four(model.grid.cell());
  double scale = options.widest_m;
  Pose pose = start;
  TurnedPoints turned(points.size());
  for (int i = 0; i < options.max_iterations; ++i) {
    const Pose to_model = pose.inverse();
    const std::size_t within = turned.turn(model.grid, points, to_model);
    pairs.clear();
    distances.clear();
    for (std::size_t from = 0; from < within; from += TurnedPoints::lanes) {
      const Four3 point = turned.places(from);
      const auto found = model.grid.refined(point, turned.voxels_at(from));
      const Four3 away = point - found.point;
      const Four out = found.normal.dot(away);
      const Four3 across = away - out * found.normal;
      const Four length = root(across.dot(across));
      const Four beside = length > blur ? length - blur : four(0);
      const Four squared = out * out + beside * beside;
      pairs.push_back({point, found.normal, across / (length + 1e-12), out, beside, squared});
      for (std::size_t n = 0; n < TurnedPoints::lanes; ++n) {
        if (from + n >= within) {
          pairs.back().squared[n] = std::numeric_limits<double>::infinity();
        } else if (squared[n] < scale * scale) {
          distances.push_back(squared[n]);
        }
      }
    }
    if (distances.size() < least_points) break;
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    scale =
        std::clamp(options.scale_sigmas * 1.4826 * std::sqrt(*middle), options.narrowest_m, scale);
    NormalSums sums(false);
    for (const Pairs& p : pairs) {
      const Four rest = 1 - p.squared / (scale * scale);
      const Four weight = rest > 0 ? rest * rest : four(0);  // Tukey
      sums.add(p.normal, p.point.cross(p.normal), weight, -weight * p.out);
      sums.add(p.across, p.point.cross(p.across), p.beside > 0 ? weight : four(0),
               -weight * p.beside);
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
