// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/ground_truth_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <functional>
#include <vector>

#include "common/bus/loop.h"
#include "lcmtypes/conversions.h"

namespace berth::made {

inline constexpr Utime start = 1000 * second;
inline constexpr std::int64_t session = 7;
inline constexpr double mm = 1e-3;

/// Truth with equal sigmas on all axes.
inline ground_truth_t truth(Utime utime, const Pose& pose, double sigma_m = 1e-3,
                            double sigma_rad = 1e-3) {
  ground_truth_t message{};
  message.utime = utime;
  message.seq = utime;
  message.session = session;
  set_pose(pose, message);
  for (int i = 0; i < 6; ++i) {
    message.covariance[7 * i] = i < 3 ? sigma_m * sigma_m : sigma_rad * sigma_rad;
  }
  return message;
}

inline pose_estimate_t estimate(Utime utime, const Pose& pose,
                                std::int8_t status = pose_estimate_t::OK) {
  pose_estimate_t message{};
  message.utime = utime;
  message.seq = utime;
  message.session = session;
  message.status = status;
  set_pose(pose, message);
  set_pose(pose, message.measured_position_m, message.measured_q_wxyz);
  for (int i = 0; i < 6; ++i) message.covariance[7 * i] = i < 3 ? 9e-6 : 4e-6;
  return message;
}

struct MadeStep {
  const char* phase;
  double from_s;
  double to_s;
};

/// A finished procedure with these steps, all passed.
inline procedure_state_t state(const std::vector<MadeStep>& steps) {
  procedure_state_t message{};
  message.session = session;
  message.state = procedure_state_t::FINISHED;
  message.outcome = procedure_state_t::PASS;
  message.procedure = "made";
  message.utime_start = start;
  message.current_step = -1;
  for (const MadeStep& s : steps) {
    procedure_step_t step{};
    step.name = s.phase;
    step.phase = s.phase;
    step.state = procedure_step_t::PASSED;
    step.utime_start = start + utime_from_seconds(s.from_s);
    step.utime_end = start + utime_from_seconds(s.to_s);
    message.utime = step.utime_end + second;
    message.steps.push_back(step);
  }
  message.step_count = static_cast<std::int32_t>(message.steps.size());
  return message;
}

/// Coming straight on at 20 mm/s from 5 m, turning at 1 deg/s about z.
inline Pose flight(double t) {
  return {Vector3d(0.1, -0.2, 5.0 - 0.02 * t), rotation_from_vector({0, 0, radians(1.0) * t})};
}

}  // namespace berth::made
