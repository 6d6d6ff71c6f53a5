// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "common/core/covariance.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

struct Mount {
  Vector6d offset = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
  std::int64_t samples = 0;
};

/// Whether the target rests in the sensor frame: what moves has errors of time as well.
bool rests(const ComparedEstimate& c) {
  return c.truth.velocity.linear.norm() < 1e-3 && c.truth.velocity.angular.norm() < radians(0.05);
}

/// The mean difference of estimate and truth where the target rests, each weighted by its own
/// covariance. Its uncertainty: the scatter of the differences about it, and all of truth's own,
/// which does not average out.
Mount mount_of(const Measurer& measurer, const Phase& phase) {
  Mount mount;
  Matrix6d information = Matrix6d::Zero();
  Vector6d weighted = Vector6d::Zero();
  Matrix6d of_truth = Matrix6d::Zero();
  std::vector<const ComparedEstimate*> at_rest;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime) || !rests(c)) continue;
    if (!is_covariance(c.estimate.covariance)) continue;
    const Matrix6d weight = c.estimate.covariance.llt().solve(Matrix6d::Identity());
    information += weight;
    weighted += weight * c.error;
    of_truth += c.truth.covariance;
    at_rest.push_back(&c);
  }
  mount.samples = static_cast<std::int64_t>(at_rest.size());
  if (at_rest.empty()) return mount;
  const auto n = static_cast<double>(at_rest.size());
  mount.offset = information.ldlt().solve(weighted);
  Matrix6d scatter = Matrix6d::Zero();
  for (const ComparedEstimate* c : at_rest) {
    const Vector6d off = c->error - mount.offset;
    scatter += off * off.transpose();
  }
  if (at_rest.size() > 1) mount.covariance = scatter / (n - 1) / n;
  mount.covariance += of_truth / n;
  return mount;
}

Measured measured(const Mount& mount, double value, double sigma) {
  if (mount.samples >= 3) return {value, sigma, mount.samples, ""};
  return {std::numeric_limits<double>::quiet_NaN(), 0, mount.samples,
          "fewer than three estimates while the target rests"};
}

template <int first>
Measured size(const Measurer& measurer, const Phase& phase) {
  const Mount mount = mount_of(measurer, phase);
  const Uncertain v =
      length_of(mount.offset.segment<3>(first), mount.covariance.block<3, 3>(first, first));
  return measured(mount, v.value, v.truth_sigma);
}

template <int axis>
Measured component(const Measurer& measurer, const Phase& phase) {
  const Mount mount = mount_of(measurer, phase);
  return measured(mount, mount.offset(axis), std::sqrt(mount.covariance(axis, axis)));
}

}  // namespace

void add_mount(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("calibration", table);
  const auto length = berth::Dimension::length;
  const auto angle = berth::Dimension::angle;
  family.number("mount_offset", length, smaller_is_better, size<0>,
                "constant offset of estimate from truth while the target rests: length of the "
                "weighted mean of the errors");
  family.number("mount_turn", angle, smaller_is_better, size<3>,
                "constant turn of estimate from truth at rest");
  family.detail().number("mount_x", length, smaller_is_better, component<0>,
                         "constant offset along x");
  family.detail().number("mount_y", length, smaller_is_better, component<1>, "along y");
  family.detail().number("mount_z", length, smaller_is_better, component<2>, "along z");
  family.detail().number("mount_turn_x", angle, smaller_is_better, component<3>,
                         "constant turn about x");
  family.detail().number("mount_turn_y", angle, smaller_is_better, component<4>, "about y");
  family.detail().number("mount_turn_z", angle, smaller_is_better, component<5>, "about z");
}

}  // namespace berth::evaluation
