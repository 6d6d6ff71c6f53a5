// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/validation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/core/text.h"

namespace berth::estimator {

namespace {

/// Whether a count exceeds the share allowed by two standard deviations of a binomial draw.
bool exceeds(int found, int count, double share) {
  return found > share * count + 2 * std::sqrt(share * (1 - share) * count);
}

/// Extent of points across their longest axis: the second largest standard deviation, m.
class Spread {
 public:
  void add(const Vector3d& point) {
    sum_ += point;
    products_ += point * point.transpose();
    ++count_;
  }
  double width() const {
    if (count_ == 0) return 0;
    const Vector3d mean = sum_ / count_;
    const Matrix3d covariance = products_ / count_ - mean * mean.transpose();
    const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(covariance, Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(0.0, solver.eigenvalues()[1]));
  }

 private:
  Vector3d sum_ = Vector3d::Zero();
  Matrix3d products_ = Matrix3d::Zero();
  double count_ = 0;
};

}  // namespace

std::string validation_failure(const TargetModel& model, const BeamModel& beam_model,
                               const PreprocessedScan& scan, const Pose& pose,
                               const ValidationOptions& options) {
  const double length = model.target.length;
  const Pose to_model = pose.inverse();
  Spread spread;
  int near = 0;
  int outliers = 0;
  int explained = 0;
  int through = 0;
  const std::size_t stride = 1 + scan.beams.size() / static_cast<std::size_t>(options.max_beams);
  for (std::size_t i = 0; i < scan.beams.size(); i += stride) {
    const Beam& beam = scan.beams[i];
    // By noise and mesh errors.
    const double range_sigma = beam.range_sigma > 0 ? beam.range_sigma : beam_model.range_sigma_m;
    const double across = beam_model.azimuth_sigma_rad * (beam.hit() ? beam.range : 0);
    const double tolerance = 4 * (range_sigma + across) + 0.005 * length;
    const Vector3d direction = to_model.rotation * beam.direction;
    RayHit hit;
    if (model.caster.cast({to_model.position, direction}, 1e9, hit)) {
      constexpr double min_cosine = 0.2;
      const double depth = tolerance / std::max(min_cosine, std::abs(direction.dot(hit.normal)));
      if (beam.range > hit.range + depth) {
        ++through;
      } else if (beam.range > hit.range - depth) {
        ++explained;
      }
    }
    if (!beam.hit()) continue;
    const Vector3d point = to_model * beam.point();
    const double distance = (model.caster.nearest(point) - point).norm();
    if (distance > options.near * length) continue;
    ++near;
    spread.add(point);
    if (distance > tolerance) ++outliers;
  }
  if (exceeds(outliers, near, options.max_outlier_share)) {
    return fixed(100.0 * outliers / near, 0) +
           " % of the returns about the target are not from it, at most " +
           fixed(100 * options.max_outlier_share, 0) +
           " % are allowed: it seems part of a larger body";
  }
  if (exceeds(through, explained + through, options.max_through)) {
    return fixed(100.0 * through / (explained + through), 0) +
           " % of the beams on the target pass through it, at most " +
           fixed(100 * options.max_through, 0) + " % are allowed";
  }
  if (spread.width() < options.min_spread * length) {
    return "the returns lie on a line or in one point and do not determine a pose";
  }
  return "";
}

}  // namespace berth::estimator
