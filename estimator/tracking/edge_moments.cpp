// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_moments.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace berth::estimator {

EdgeMoments edge_moments(const EdgeView& view, const LikelihoodOptions& shares,
                         double least_cosine) {
  const double rare = shares.outlier / shares.background_depth_m;
  const double past = shares.background / shares.background_depth_m;
  const double regularly = 1 - shares.drop_out - shares.outlier;

  // With the beam's place on the target: moving the target is moving the beam the other way.
  const Eigen::Matrix<double, 3, 2> with_place = -view.cavity.leftCols<2>() / view.range;
  const Eigen::Matrix<double, 3, 2> gain = with_place * view.spread.inverse();
  const Eigen::Matrix<double, 3, 2> of_width = gain * view.width;
  const Matrix3d rest = view.cavity - gain * with_place.transpose() + of_width * gain.transpose();

  double total = 0;
  double squares = 0;
  Vector3d first = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero();
  const auto add = [&](double weight, const Vector3d& mean) {
    total += weight;
    first += weight * mean;
    second += weight * mean * mean.transpose();
  };
  for (std::size_t k = 0; k < view.nodes; ++k) {
    const RayHit& hit = view.hits[k];
    const Vector3d mean = gain * view.off[k];
    const bool meets = std::isfinite(hit.range);
    const double anyhow = !view.beam->hit() ? (meets ? shares.drop_out : 1 - shares.background)
                                            : (meets ? rare : past);
    add(anyhow, mean);
    squares += anyhow * anyhow;
    if (!meets || !view.beam->hit()) continue;
    const double facing = hit.normal.dot(view.rays[k].direction);
    if (-facing < 0.5 * least_cosine) continue;
    const Eigen::Vector2d slope =
        -hit.range / facing * (view.axes.leftCols<2>().transpose() * hit.normal);
    const Vector3d with_range = rest.col(2) + of_width * slope;
    const double variance =
        view.range_variance +
        std::max(0.0, rest(2, 2) + 2 * of_width.row(2).dot(slope) + slope.dot(view.width * slope));
    const double late = view.beam->range - hit.range - mean.z() - view.mean.z();
    const double weight = regularly * std::exp(-0.5 * late * late / variance) /
                          std::sqrt(2 * std::numbers::pi * variance);
    add(weight, mean + with_range * (late / variance));
    squares += weight * (weight + 2 * anyhow);
    second -= weight / variance * with_range * with_range.transpose();
  }
  first /= total;
  return {first, rest + second / total - first * first.transpose(), total * total / squares};
}

}  // namespace berth::estimator
