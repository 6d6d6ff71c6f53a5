// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/optimal_rays.h"

#include <Eigen/Dense>
#include <cmath>

namespace berth::benchmark {
namespace {

constexpr int candidates = 20000;

using Rays = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Each column c gives the information c c'; rotations are times the lever.
Rays candidate_rays(const World& world, Window window, const Pose& pose, double lever,
                    double min_cosine) {
  window.count = 1000;
  window.count =
      static_cast<int>(1000.0 * candidates / std::max(1.0, world.expected_returns({window}, pose)));
  const BeamModel& noise = world.physics().noise;
  const Pose to_model = pose.inverse();
  Rays rays(6, window.count + 100);
  Eigen::Index count = 0;
  for (const auto& [azimuth, elevation] : raster(window)) {
    const Vector3d u = beam_direction(azimuth, elevation);
    RayHit hit;
    if (!world.caster().cast({to_model.position, to_model.rotation * u}, noise.range_max_m, hit)) {
      continue;
    }
    const Vector3d n = pose.rotation * hit.normal;
    const double cosine = -n.dot(u);
    if (cosine < min_cosine || count == rays.cols()) continue;
    const double slope = hit.range * std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine;
    const double sigma = std::hypot(noise.range_sigma_m, slope * noise.azimuth_sigma_rad);
    rays.col(count).head<3>() = n / (cosine * sigma);
    rays.col(count).tail<3>() = (hit.range * u - pose.position).cross(n) / (cosine * sigma * lever);
    ++count;
  }
  return rays.leftCols(count);
}

/// What the trace of C shrinks by (sign 1) or grows by (sign -1) with each ray more or less.
Eigen::ArrayXd change(const Matrix6d& c, const Rays& rays, double sign) {
  const Rays product = c * rays;
  return product.colwise().squaredNorm().transpose().array() /
         (1 + sign * product.cwiseProduct(rays).colwise().sum().transpose().array());
}

void apply(Matrix6d& c, const Vector6d& ray, double sign) {
  const Vector6d product = c * ray;
  c -= sign * product * product.transpose() / (1 + sign * ray.dot(product));
}

}  // namespace

double rms_bound(const Matrix6d& information, double lever) {
  Vector6d scale;
  scale << 1, 1, 1, lever, lever, lever;
  const Matrix6d covariance = information.ldlt().solve(Matrix6d::Identity());
  return std::sqrt((scale.asDiagonal() * covariance * scale.asDiagonal()).trace());
}

double optimal_rms_bound(const World& world, const Window& window, const Pose& pose, int rays,
                         double lever, double min_cosine, int max_repeats) {
  const Rays all = candidate_rays(world, window, pose, lever, min_cosine);
  Eigen::ArrayXi times = Eigen::ArrayXi::Zero(all.cols());
  Matrix6d c = Matrix6d::Identity();  // as good as nothing known: 1 m
  const auto best_to_add = [&] {
    Eigen::Index best = 0;
    (times < max_repeats).select(change(c, all, 1), -1).maxCoeff(&best);
    return best;
  };
  for (int i = 0; i < rays; ++i) {
    const Eigen::Index best = best_to_add();
    ++times[best];
    apply(c, all.col(best), 1);
  }
  for (int i = 0; i < rays; ++i) {
    Eigen::Index worst = 0;
    (times > 0).select(change(c, all, -1), 1e30).minCoeff(&worst);
    const double before = c.trace();
    apply(c, all.col(worst), -1);
    --times[worst];
    const Eigen::Index best = best_to_add();
    ++times[best];
    apply(c, all.col(best), 1);
    if (c.trace() > before * (1 - 1e-7)) break;
  }
  return std::sqrt(c.trace());
}

}  // namespace berth::benchmark
