// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/guidance/chaser.h"
#include "testbed/guidance/steering.h"

namespace berth::testbed {

/// Set-point of an external GNC: velocities of the chaser, in the sensor's own axes.
struct ExternalSetpoint {
  std::int64_t utime_expires = 0;  ///< us
  Velocity velocity;
};

/// Flies by the set-points of an external GNC, within the command's speeds and the testbed's
/// accelerations. Without a valid set-point the chaser is brought to rest.
class ExternalFlight final : public Steering {
 public:
  /// commander: the only one whose set-points are obeyed.
  ExternalFlight(std::string commander, const RelativeLimits& limits, const Pose& commanded);

  const std::string& commander() const { return commander_; }
  void obey(const ExternalSetpoint& setpoint) { setpoint_ = setpoint; }
  Output step(std::int64_t now, double dt) override;
  GuidanceReport report() const override;

 private:
  std::string commander_;
  RelativeLimits limits_;
  Chaser chaser_;
  ExternalSetpoint setpoint_;
  std::string reason_;
  double time_ = 0;
};

}  // namespace berth::testbed
