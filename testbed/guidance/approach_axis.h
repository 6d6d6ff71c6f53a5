// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "common/core/ray_caster.h"
#include "common/targets/target.h"
#include "testbed/guidance/profile.h"
#include "testbed/guidance/steering.h"

namespace berth::testbed {

/// The target of an approach: its surface, and the docking port.
struct ApproachTarget {
  const RayCaster* surface = nullptr;  ///< model frame; must outlive the flight
  std::optional<DockingPort> port = std::nullopt;
};

/// The line along which a target is approached, and the reference pose at a distance along it.
class ApproachAxis {
 public:
  /// dock: ranges are of the docking interface, otherwise of the nearest surface.
  /// sensor, target: T_N_sensor, T_N_model at the start.
  ApproachAxis(const ApproachTarget& target, GuidanceProfile::Align align, bool dock,
               const Pose& sensor, const Pose& model);

  /// Reference motion of the sensor, frame N.
  struct Reference {
    Pose pose;  ///< T_N_sensor
    Velocity velocity;
    Vector3d acceleration = Vector3d::Zero();
  };
  /// along: m from the aim point; speed, acceleration: its rates.
  Reference reference(const Pose& model, const Velocity& moving, double along, double speed,
                      double acceleration) const;
  /// Sets up keeping this pose relative to the target. @return its distance from the aim point, m
  double keep(const Pose& sensor, const Pose& model);

  struct Place {
    double along = 0;   ///< m from the aim point
    double offset = 0;  ///< m from the axis
    double range = 0;   ///< m from the sensor to the interface or the nearest surface
  };
  Place place(const Pose& sensor, const Pose& model) const;
  /// Frame N, unit, away from the target.
  Vector3d direction(const Pose& model) const;
  /// rad off the axis within which an approach may begin.
  double approach_cone() const { return turning() ? target_.port->approach_cone : radians(90); }

 private:
  bool turning() const { return align_ == GuidanceProfile::Align::docking_axis; }

  ApproachTarget target_;
  GuidanceProfile::Align align_;
  bool dock_;
  Vector3d aim_ = Vector3d::Zero();    // model frame
  Vector3d axis_ = Vector3d::UnitZ();  // outwards: model frame when turning, else frame N
  Quaterniond attitude_;               // of the sensor, in the model when turning, else in N
};

}  // namespace berth::testbed
