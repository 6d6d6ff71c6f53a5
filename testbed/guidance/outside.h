// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/guidance/chaser.h"
#include "testbed/guidance/steering.h"

namespace berth::testbed {

/// What an outside GNC asks for: velocities of the chaser, in the sensor's own axes.
struct OutsideSetpoint {
  std::int64_t utime_expires = 0;  ///< us
  Velocity velocity;
};

/// Flies as an outside GNC says, within the command's speeds and the testbed's accelerations.
/// Without a set-point that is still good the chaser is brought to rest.
class OutsideFlight final : public Steering {
 public:
  /// commander: whose set-points are obeyed.
  OutsideFlight(std::string commander, const RelativeLimits& limits, const Pose& commanded);

  const std::string& commander() const { return commander_; }
  void obey(const OutsideSetpoint& setpoint) { setpoint_ = setpoint; }
  Output step(std::int64_t now, double dt) override;
  GuidanceReport report() const override;

 private:
  std::string commander_;
  RelativeLimits limits_;
  Chaser chaser_;
  OutsideSetpoint setpoint_;
  std::string reason_;
  double time_ = 0;
};

}  // namespace berth::testbed
