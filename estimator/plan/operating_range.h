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

/// The paper's operating ranges (Figure 1, section 3.1), as pose_estimate_t numbers them. Long:
/// only a centroid, a coarse axis at best. Medium: the full pose. Short: the target no longer fits
/// in the field of view, and its docking interface is looked at.
enum class OperatingRange : std::int8_t { long_range, medium_range, short_range };

struct RangeOptions {
  double medium_beams = 100;  ///< that fit side by side along the target, for its full pose
  double hysteresis = 0.1;    ///< of a boundary, half to either side
  int axis_returns = 60;      ///< for the moments of a target in long range; fewer: a point
  int search_growth = 4;      ///< times the beams of the next search after one that told too little
  double docking_share = 0.12;  ///< radius of what is scanned about the docking interface, of the
                                ///< target's length
  std::string docking_port;     ///< its name; empty: the nearest to the sensor
};

/// Which range a distance belongs to, with hysteresis about the boundaries.
class RangeSwitch {
 public:
  RangeSwitch(const TargetModel& model, const LidarProfile& lidar, const RangeOptions& options);

  /// What is suited to a distance (m) from the sensor to the target's centre, when `now` is in use.
  OperatingRange suited(double distance, OperatingRange now) const;
  /// Farther than this, m, the target is too small; nearer than that, too large.
  double far() const { return far_; }
  double near() const { return near_; }

 private:
  double far_ = 0;
  double near_ = 0;
  double half_width_ = 0;  // of the hysteresis
};

/// What is looked at when the whole target no longer fits in the field of view: a sphere about the
/// docking port of the options, or that which is nearest to the sensor. Nothing when the target has
/// none.
/// @param pose T_sensor_model
std::optional<ModelSphere> docking_region(const TargetModel& model, const RangeOptions& options,
                                          const Pose& pose);
/// @throws InputError where the options name a docking port that the target has not.
void require_port(const Target& target, const RangeOptions& options);

}  // namespace berth::estimator
