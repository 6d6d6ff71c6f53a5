// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/foreign_kinematics.h"

#include <sstream>

#include "common/core/text.h"

namespace berth {
namespace {

/// m: rounding is less, another arm, another zero or a base frame of its own more.
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
