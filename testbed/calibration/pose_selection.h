// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "common/core/lidar_profile.h"
#include "testbed/calibration/calibration.h"
#include "testbed/motion/motion_planner.h"

namespace berth::testbed {

/// Limits of the target's pose within which it can be measured.
struct CalibrationView {
  double nearest = 0;  ///< m, of the model's origin
  double farthest = 0;
  double half_angle = 0;                           ///< rad, of the model's origin off the boresight
  Quaterniond attitude = Quaterniond::Identity();  ///< at home
  double turn = 0;                                 ///< rad, greatest rotation from that
};
/// All of the target within the profile's range and field of view.
CalibrationView calibration_view(const Cell& cell, const LidarProfile& profile);

struct SelectionOptions {
  int poses = 48;
  int candidates = 400;            ///< drawn for each pose
  double position_sigma = 0.4e-3;  ///< m, of a measurement at a pose, each axis
  double rotation_sigma = radians(0.01);
  RelativeLimits limits;  ///< of the motions between poses
  std::uint64_t seed = 1;
};

/// A pose to go to and to measure at.
struct CalibrationPose {
  Pose relative;  ///< T_sensor_model, by the calibration used
  FrozenArm frozen = FrozenArm::none;
  ArmPair joints;
};

/// Motion along one line and back, fast enough to identify the clocks' offsets.
struct FastStroke {
  Pose from;
  Pose to;
  FrozenArm frozen = FrozenArm::none;
  double speed = 0;  ///< m/s reached
};

struct PoseSelection {
  std::vector<CalibrationPose> poses;  ///< each reached from the one before
  std::vector<FastStroke> strokes;  ///< after them, in this order; beginning with a move to `from`
  double expected_position = 0;     ///< m, rms error of truth afterwards over the workspace
  double expected_rotation = 0;     ///< rad
};

/// Chooses poses one by one (greedy design of experiments): of candidates drawn at random in the
/// sensor's view, reached by one arm or both, the one that reduces truth's uncertainty over the
/// workspace most, if the way there passes the check. Then strokes with each arm alone at the
/// requested speed.
/// @param progress called before each pose with its number
/// @throws InputError when fewer than ten poses can be reached, or no stroke.
PoseSelection select_poses(const Cell& cell, const MotionPlanner& planner,
                           const CalibrationView& view, const Eigen::MatrixXd& prior,
                           double fast_speed, const SelectionOptions& options,
                           const std::function<void(int)>& progress = {});

}  // namespace berth::testbed
