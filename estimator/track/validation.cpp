// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/validation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/core/text.h"

namespace berth::estimator {

namespace {

/// Whether so many of a count are more than the share that may be, by twice the chance of the draw.
bool exceeds(int found, int count, double share) {
  return found > share * count + 2 * std::sqrt(share * (1 - share) * count);
}

/// How wide points spread across their longest extent: the second of their standard deviations, m.
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

std::string doubt(const TargetModel& model, const BeamModel& beam_model, const CleanScan& scan,
                  const Pose& pose, const VerificationOptions& options) {
  const double length = model.target.length;
  const Pose to_model = pose.inverse();
  Spread spread;
  int about = 0;
  int beside = 0;
  int explained = 0;
  int through = 0;
  const std::size_t stride = 1 + scan.beams.size() / static_cast<std::size_t>(options.beams);
  for (std::size_t i = 0; i < scan.beams.size(); i += stride) {
    const Beam& beam = scan.beams[i];
    // What noise, and a mesh that is not the thing itself, may do.
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
    if (distance > options.about * length) continue;
    ++about;
    spread.add(point);
    if (distance > tolerance) ++beside;
  }
  if (exceeds(beside, about, options.max_beside)) {
    return fixed(100.0 * beside / about, 0) +
           " % of the returns about the target are not from it, at most " +
           fixed(100 * options.max_beside, 0) + " % may: it seems part of something else";
  }
  if (exceeds(through, explained + through, options.max_through)) {
    return fixed(100.0 * through / (explained + through), 0) +
           " % of the beams on the target go through it, at most " +
           fixed(100 * options.max_through, 0) + " % may";
  }
  if (spread.width() < options.min_width * length) {
    return "the returns lie on a line or in one place: that holds no pose";
  }
  return "";
}

}  // namespace berth::estimator
