// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <memory>
#include <string>

#include "testbed/motion/motion_planner.h"
#include "testbed/settings.h"

namespace berth::testbed {

/// How far a motion keeps from what stops arms, at the worst place of its second half: where it
/// begins is the same for all.
struct Ease {
  double joint = 1e9;  ///< rad to a joint's own limit
  double manipulability = 1e9;
};

/// A cell, its planner and their settings, as the testbed node has them.
struct Bench {
  explicit Bench(const std::string& layout = "range")
      : cell(load_cell("config/layouts/" + layout + ".yaml", load_target("radarsat2", 0))) {}

  Pose home_pose() const { return cell.relative_pose(home.replica, home.sensor); }

  Ease ease(const ArmMotion& motion) const {
    Ease ease;
    ArmPair near = home;
    for (int k = 1; k <= 100; ++k) {
      near = motion.at(motion.duration() * k / 100, near, nullptr).value();
      if (k < 50) continue;
      for (const ArmRole role : both_arms) {
        const ArmKinematics& arm = *cell.arm(role).kinematics;
        ease.manipulability = std::min(ease.manipulability, arm.manipulability(near.of(role)));
        for (std::size_t i = 0; i < 6; ++i) {
          ease.joint = std::min({ease.joint, near.of(role)[i] - arm.limits()[i].low,
                                 arm.limits()[i].high - near.of(role)[i]});
        }
      }
    }
    return ease;
  }

  /// m/s of a straight path at which the motion just passes the check, so shared out.
  double max_speed(const Pose& goal, const RedundancyResolution& resolution) const {
    double low = 0;
    double high = 2;
    for (int i = 0; i < 10; ++i) {
      const double speed = 0.5 * (low + high);
      RelativeLimits limits = settings.motion;
      limits.speed = speed;
      limits.acceleration = limits.angular_speed = limits.angular_acceleration = 10 * speed;
      const RelativeMotion motion(std::make_shared<StraightPath>(home_pose(), goal, limits),
                                  ArmAllocation(cell, resolution, FrozenArm::none, home));
      (check.check(motion, home) ? high : low) = speed;
    }
    return low;
  }

  Cell cell;
  Settings settings = load_settings("config/testbed.yaml");
  Clearance clearance{cell, settings.clearance};
  PathCheck check{cell, settings.path, clearance};
  MotionPlanner planner{cell, check, clearance};
  ArmPair home{cell.replica.home, cell.sensor.home};
};

}  // namespace berth::testbed
