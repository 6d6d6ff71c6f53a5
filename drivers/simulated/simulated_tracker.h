// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <functional>

#include "common/bus/loop.h"
#include "common/core/random.h"
#include "common/core/reflectors.h"

namespace berth {

/// A laser tracker that looks at one reflector after the other and writes what it sees into a CSV
/// file, as an operator's instrument would: time (s), point, x, y, z (mm) in the tracker's own
/// frame. Nothing stands in its way.
class SimulatedTracker {
 public:
  struct Options {
    bool write = false;
    Utime period = 50 * millisecond;  ///< from one reflector to the next
    Pose place;                       ///< T_cell_tracker
  };
  /// T_cell_sensor or T_cell_model, truly, at a time up to now.
  using ToolPose = std::function<Pose(ArmRole, Utime)>;

  /// @throws InputError when the file cannot be written.
  SimulatedTracker(const TrackerSetup& setup, const Options& options, std::uint64_t seed,
                   ToolPose tool, Loop& loop, const std::filesystem::path& file);
  ~SimulatedTracker();

 private:
  void measure();

  TrackerSetup setup_;
  Pose to_tracker_;
  Random random_;
  ToolPose tool_;
  Loop& loop_;
  std::ofstream file_;
  std::size_t next_ = 0;
  Loop::TimerId timer_;
};

}  // namespace berth
