// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/ground_truth.h"

namespace berth::testbed {
namespace {

/// Jacobian of a point of an arm's tool, in the cell frame, by the arm's joints.
Matrix6d point_jacobian(const PlacedArm& arm, const Joints& joints, const Vector3d& point) {
  const Pose flange = arm.base * arm.kinematics->forward(joints);
  const Matrix3d to_cell = arm.base.rotation.toRotationMatrix();
  const Matrix6d in_base = arm.kinematics->jacobian(joints);
  Matrix6d jacobian;
  jacobian.bottomRows<3>() = to_cell * in_base.bottomRows<3>();
  jacobian.topRows<3>() =
      to_cell * in_base.topRows<3>() - skew(point - flange.position) * jacobian.bottomRows<3>();
  return jacobian;
}

Vector6d squared(const Joints& sigma) {
  Vector6d variance;
  for (std::size_t i = 0; i < 6; ++i) {
    variance[static_cast<Eigen::Index>(i)] = sigma[i] * sigma[i];
  }
  return variance;
}

}  // namespace

Matrix6d joint_covariance(const Cell& cell, const ArmPair& joints, const ArmPair& sigma) {
  const Pose sensor = cell.sensor.tool_pose(joints.sensor);
  const Vector3d model = cell.replica.tool_pose(joints.replica).position;
  // The sensor arm moves the model in the sensor frame as if the model moved the other way with it.
  const Matrix6d by_replica = point_jacobian(cell.replica, joints.replica, model);
  const Matrix6d by_sensor = point_jacobian(cell.sensor, joints.sensor, model);
  const Matrix6d in_cell =
      by_replica * squared(sigma.replica).asDiagonal() * by_replica.transpose() +
      by_sensor * squared(sigma.sensor).asDiagonal() * by_sensor.transpose();
  const Matrix3d to_sensor = sensor.rotation.conjugate().toRotationMatrix();
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = to_sensor;
  turn.bottomRightCorner<3, 3>() = to_sensor;
  return turn * in_cell * turn.transpose();
}

GroundTruth::GroundTruth(const Cell& cell, const Settings& settings, Publish publish)
    : cell_(cell), settings_(settings), publish_(std::move(publish)) {}

std::deque<JointSample>& GroundTruth::of(ArmRole role) {
  return role == ArmRole::replica ? replica_ : sensor_;
}

void GroundTruth::add(ArmRole role, const JointSample& sample) {
  std::deque<JointSample>& samples = of(role);
  if (!samples.empty() && sample.utime <= samples.back().utime) return;
  samples.push_back(sample);
  if (replica_.empty() || sensor_.empty()) {
    // keep what may still be the earlier neighbour of a grid time
    while (samples.size() > 2) samples.pop_front();
    return;
  }
  const std::int64_t period = settings_.period;
  const std::int64_t first = std::max(replica_.front().utime, sensor_.front().utime);
  if (next_ < first) next_ = (first + period - 1) / period * period;
  const std::int64_t last = std::min(replica_.back().utime, sensor_.back().utime);
  for (; next_ <= last; next_ += period) {
    Interpolated replica;
    Interpolated sensor;
    if (interpolate_at(ArmRole::replica, next_, replica) &&
        interpolate_at(ArmRole::sensor, next_, sensor)) {
      publish(next_, replica, sensor);
    } else {
      ++skipped_;
    }
  }
  for (const ArmRole role_of_queue : both_arms) {
    std::deque<JointSample>& queue = of(role_of_queue);
    while (queue.size() > 1 && queue[1].utime <= next_) queue.pop_front();
  }
}

bool GroundTruth::interpolate_at(ArmRole role, std::int64_t utime, Interpolated& result) {
  const std::deque<JointSample>& samples = of(role);
  std::size_t i = 0;
  while (i + 1 < samples.size() && samples[i + 1].utime <= utime) ++i;
  const JointSample& before = samples[i];
  if (before.utime > utime) return false;
  if (before.utime == utime) {
    result = {before.joints, before.sigma};
    return true;
  }
  if (i + 1 == samples.size()) return false;
  const JointSample& after = samples[i + 1];
  if (after.utime - before.utime > settings_.largest_gap) return false;
  const double s =
      static_cast<double>(utime - before.utime) / static_cast<double>(after.utime - before.utime);
  for (std::size_t k = 0; k < 6; ++k) {
    result.joints[k] = before.joints[k] + s * (after.joints[k] - before.joints[k]);
    result.sigma[k] = std::max(before.sigma[k], after.sigma[k]);
  }
  return true;
}

void GroundTruth::publish(std::int64_t utime, const Interpolated& replica,
                          const Interpolated& sensor) {
  Truth truth;
  truth.utime = utime;
  truth.pose = cell_.relative_pose(replica.joints, sensor.joints);
  while (!recent_.empty() && utime - recent_.front().utime > settings_.velocity_window) {
    recent_.pop_front();
  }
  if (!recent_.empty()) {
    truth.velocity = velocity_between(recent_.front().pose, truth.pose,
                                      static_cast<double>(utime - recent_.front().utime) * 1e-6);
  }
  truth.covariance =
      joint_covariance(cell_, {replica.joints, sensor.joints}, {replica.sigma, sensor.sigma});
  Vector6d rate;
  rate << truth.velocity.linear, truth.velocity.angular;
  truth.covariance += settings_.time_sigma * settings_.time_sigma * rate * rate.transpose();
  for (int i = 0; i < 3; ++i) {
    truth.covariance(i, i) += settings_.position_sigma * settings_.position_sigma;
    truth.covariance(i + 3, i + 3) += settings_.rotation_sigma * settings_.rotation_sigma;
  }
  recent_.push_back(truth);
  publish_(truth);
}

}  // namespace berth::testbed
