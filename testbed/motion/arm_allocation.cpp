// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/arm_allocation.h"

#include <cmath>
#include <numbers>

#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

std::optional<Joints> nearest_solution(const ArmKinematics& arm, const Pose& flange,
                                       const Joints& near, std::string* reason) {
  constexpr double turn = 2 * std::numbers::pi;
  std::optional<Joints> best;
  double best_distance = 0;
  for (InverseSolution& solution : arm.inverse(flange, reason)) {
    double distance = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      double& q = solution.joints[i];
      if (!arm.is_linear(static_cast<int>(i))) {
        const double turned = q + turn * std::round((near[i] - q) / turn);
        const JointLimit& limit = arm.limits()[i];
        if (turned >= limit.low && turned <= limit.high) q = turned;
      }
      distance += (q - near[i]) * (q - near[i]);
    }
    if (!best || distance < best_distance) {
      best = solution.joints;
      best_distance = distance;
    }
  }
  return best;
}

ArmAllocation::ArmAllocation(const Cell& cell, const RedundancyResolution& resolution,
                             FrozenArm frozen, const ArmPair& start)
    : cell_(&cell),
      resolution_(resolution),
      frozen_(frozen),
      start_(start),
      start_sensor_(cell.sensor.tool_pose(start.sensor)),
      start_replica_(cell.replica.tool_pose(start.replica)),
      home_sensor_(cell.sensor.tool_pose(cell.sensor.home)),
      middle_(0.5 * (home_sensor_.position + cell.replica.tool_pose(cell.replica.home).position)),
      home_relative_(cell.relative_pose(cell.replica.home, cell.sensor.home)) {
  correction_ =
      difference(nominal_sensor(start_sensor_.inverse() * start_replica_, 0), start_sensor_);
}

Pose ArmAllocation::nominal_sensor(const Pose& relative, double progress) const {
  const Vector3d closer = home_relative_.position - relative.position;
  const Vector3d moved(resolution_.lateral * closer.x(), resolution_.lateral * closer.y(),
                       resolution_.travel * closer.z());
  const double half_way = 4 * progress * (1 - progress);
  const Quaterniond turn = rotation_from_vector(resolution_.turn);
  const Vector3d sensor = home_sensor_.position + home_sensor_.rotation * moved;
  return {middle_ + turn * (sensor - middle_) + resolution_.shift + half_way * resolution_.bulge,
          turn * home_sensor_.rotation};
}

std::optional<ArmPair> ArmAllocation::joints(const Pose& relative, double progress,
                                             const ArmPair& near, std::string* reason) const {
  Pose sensor = start_sensor_;
  Pose replica = start_replica_;
  if (frozen_ == FrozenArm::replica) {
    sensor = replica * relative.inverse();
  } else {
    if (frozen_ == FrozenArm::none) {
      sensor = perturbed(nominal_sensor(relative, progress), (1 - progress) * correction_);
    }
    replica = sensor * relative;
  }
  ArmPair pair = start_;
  for (const ArmRole role : both_arms) {
    if ((role == ArmRole::replica && frozen_ == FrozenArm::replica) ||
        (role == ArmRole::sensor && frozen_ == FrozenArm::sensor)) {
      continue;
    }
    const PlacedArm& arm = cell_->arm(role);
    const Pose& tool = role == ArmRole::replica ? replica : sensor;
    std::string why;
    const auto joints = nearest_solution(
        *arm.kinematics, arm.base.inverse() * tool * arm.tool.inverse(), near.of(role), &why);
    if (!joints) {
      if (reason != nullptr) *reason = arm_name(role) + ": " + why;
      return std::nullopt;
    }
    pair.of(role) = *joints;
  }
  return pair;
}

}  // namespace berth::testbed
