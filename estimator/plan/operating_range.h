// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/core/lidar_profile.h"
#include "estimator/model/target_model.h"
#include "estimator/plan/scan_planner.h"
#include "estimator/plan/windows.h"

namespace berth::estimator {

/// The paper's operating ranges (Figure 1, section 3.1), as numbered in pose_estimate_t. Long:
/// centroid and at best a coarse axis. Medium: the full pose. Short: the target exceeds the field
/// of view, and its docking interface is scanned.
enum class OperatingRange : std::int8_t { long_range, medium_range, short_range };

struct RangeOptions {
  double medium_beams = 100;    ///< beams side by side along the target, needed for its full pose
  double hysteresis = 0.1;      ///< of a boundary, half of it to either side
  int axis_returns = 60;        ///< minimum number of returns for moments in long range
  int search_growth = 4;        ///< factor on the beams of a search after an inconclusive one
  double docking_share = 0.12;  ///< radius of the scanned docking region over the target's length
  std::string docking_port;     ///< its name; empty: the port nearest to the sensor
};

/// The operating range of a distance, with hysteresis at the boundaries.
class RangeSwitch {
 public:
  RangeSwitch(const TargetModel& model, const LidarProfile& lidar, const RangeOptions& options);

  /// For a distance (m) from the sensor to the target's centre, given the current range `now`.
  OperatingRange suited(double distance, OperatingRange now) const;
  /// Boundaries, m, of long and of short range.
  double far() const { return far_; }
  double near() const { return near_; }

 private:
  double far_ = 0;
  double near_ = 0;
  double half_width_ = 0;  // of the hysteresis
};

/// The region scanned in short range: a sphere about the docking port of the options, or the one
/// nearest to the sensor. Empty for a target without ports.
/// @param pose T_sensor_model
std::optional<ModelSphere> docking_region(const TargetModel& model, const RangeOptions& options,
                                          const Pose& pose);
/// @throws InputError where the options name a docking port that the target lacks.
void require_port(const Target& target, const RangeOptions& options);

}  // namespace berth::estimator
