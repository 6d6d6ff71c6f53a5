// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/report_evaluation.h"

#include <cmath>
#include <sstream>

#include "common/core/text.h"

namespace berth {

void FollowingError::add(Utime time, const Joints& joints) {
  const double dt = seconds(time - time_);
  if (!known_) error_.fill(0);
  if (known_ && lag_ > 0 && dt > 0) {
    const double remains = std::exp(-dt / lag_);
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const double speed = (joints[i] - joints_[i]) / dt;
      error_[i] = remains * error_[i] + (1 - remains) * speed * lag_;
    }
  }
  known_ = true;
  time_ = time;
  joints_ = joints;
}

namespace {

/// m: above rounding, below the effect of another arm, zero or base frame.
constexpr double flange_tolerance = 1e-3;

}  // namespace

std::optional<double> flange_difference(const ArmReport& report, const ArmKinematics& kinematics) {
  if (!report.flange) return std::nullopt;
  return (*report.flange - kinematics.forward(report.joints).position).norm();
}

std::string foreign_kinematics(const ArmReport& report, const ArmKinematics& kinematics) {
  const std::optional<double> apart = flange_difference(report, kinematics);
  if (!apart || *apart <= flange_tolerance) return "";
  std::ostringstream text;
  const auto point = [&](const Vector3d& p) {
    for (int i = 0; i < 3; ++i) text << (i > 0 ? ", " : "") << fixed(1e3 * p[i], 1);
  };
  text << "the controller has its flange at (";
  point(*report.flange);
  text << ") mm, the arm's kinematics put it at (";
  point(kinematics.forward(report.joints).position);
  text << ") mm, " << fixed(1e3 * *apart, 1)
       << " mm away: the configured arm is not this one, or its joints' zeros are not";
  return text.str();
}

}  // namespace berth
