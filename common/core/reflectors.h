// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/core/cell.h"

namespace berth {

/// A laser tracker's target, fixed to the sensor or the replica.
struct Reflector {
  std::string name;
  ArmRole on = ArmRole::replica;
  Vector3d place = Vector3d::Zero();  ///< in the sensor or the model frame
};

/// config/tracker.yaml: where the reflectors are, and how well a tracker measures them.
struct TrackerSetup {
  std::vector<Reflector> reflectors;
  double sigma = 0;            ///< m, per axis
  double sigma_per_metre = 0;  ///< m more for each m from the tracker
  double time_sigma = 0;       ///< s between the tracker's clock and the host's

  /// 1 sigma per axis of a point this far from the tracker, m.
  double sigma_at(double range) const { return sigma + sigma_per_metre * range; }
};

/// @throws InputError.
TrackerSetup load_tracker_setup(const std::filesystem::path& file);

}  // namespace berth
