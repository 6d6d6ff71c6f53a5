// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/target_filter.h"

namespace berth::testbed {

void TargetFilter::Spread::predict(double dt, double noise) {
  const double q = noise * noise;  // for one second
  value += 2 * dt * both + dt * dt * rate + q * dt * dt * dt / 3;
  both += dt * rate + q * dt * dt / 2;
  rate += q * dt;
}

Eigen::Vector2d TargetFilter::Spread::update(double variance) {
  const double sum = value + variance;
  const Eigen::Vector2d gain(value / sum, both / sum);
  rate -= gain[1] * both;
  both -= gain[0] * both;
  value -= gain[0] * value;
  return gain;
}

TargetFilter::TargetFilter(const Settings& settings, const Seen& first)
    : settings_(settings), time_(first.time), pose_(first.pose) {
  position_.value = first.position_sigma * first.position_sigma;
  rotation_.value = first.rotation_sigma * first.rotation_sigma;
}

Vector6d TargetFilter::innovation(const Seen& seen) const {
  Vector6d away = difference(at(seen.time), seen.pose);
  if (!seen.attitude_known) away.tail<3>().setZero();
  return away;
}

void TargetFilter::add(const Seen& seen) {
  const Vector6d away = innovation(seen);
  const double dt = seen.time - time_;
  pose_ = at(seen.time);
  time_ = seen.time;
  position_.predict(dt, settings_.acceleration);
  rotation_.predict(dt, settings_.angular_acceleration);
  Vector6d change = Vector6d::Zero();
  const Eigen::Vector2d p = position_.update(seen.position_sigma * seen.position_sigma);
  change.head<3>() = p[0] * away.head<3>();
  velocity_.linear += p[1] * away.head<3>();
  if (seen.attitude_known) {
    const Eigen::Vector2d r = rotation_.update(seen.rotation_sigma * seen.rotation_sigma);
    change.tail<3>() = r[0] * away.tail<3>();
    velocity_.angular += r[1] * away.tail<3>();
  }
  pose_ = perturbed(pose_, change);
}

}  // namespace berth::testbed
