// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/finding.h"
#include "common/core/lidar_profile.h"
#include "drivers/devices.h"
#include "drivers/lidar/adapter.h"

namespace berth {

/// The LIDAR: who answers, and its clock. Nothing is scanned. A new connection takes the place of
/// the old one: a LIDAR that a run uses is left alone.
class LidarExamination {
 public:
  /// used_by: the run whose driver is connected to it; empty: none.
  LidarExamination(LidarDevice device, LidarProfile profile, std::string used_by, Loop& loop);

  std::vector<Finding> findings(Utime span) const;

 private:
  Finding identity() const;

  LidarDevice device_;
  LidarProfile profile_;
  std::string used_by_;
  std::unique_ptr<lidar::Adapter> adapter_;
};

}  // namespace berth
