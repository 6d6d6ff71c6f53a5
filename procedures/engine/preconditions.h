// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/precondition_t.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "procedures/engine/node_watch.h"
#include "procedures/engine/step_runner.h"

namespace berth::procedures {

/// Preconditions of a procedure's start and resumption: every node ready, the lease held, the
/// testbed idle, and, where those nodes are part of the rig, E-stop chain and fence closed and the
/// LIDAR ready.
/// @param going_on after a hold, when the testbed may be HELD as well as idle
std::vector<precondition_t> preconditions(const NodeWatch& nodes, const Bench& bench,
                                          bool going_on);

precondition_t make_precondition(const std::string& name, bool met, const std::string& reason);

/// Free disk space for the run's log: 2 GB, more than an hour of scans.
precondition_t room_on_disk(const std::filesystem::path& folder);

/// The unmet ones: "E-stop chain: open; fence: open"; empty: all are met.
std::string unmet(const std::vector<precondition_t>& preconditions);

/// Whether the relative pose is still what it was when everything had come to rest on hold.
class RestWatch {
 public:
  /// On hold from now on.
  void begin() {
    place_.reset();
    rest_.reset();
  }
  /// At every tick while on hold.
  void look(const Bench& bench);
  precondition_t precondition(const Bench& bench) const;

  /// More than truth's noise, less than an arm moved by hand.
  static constexpr double max_distance = 5e-3;    ///< m
  static constexpr double max_angle = 0.0087266;  ///< rad: half a degree

 private:
  std::optional<evaluation::TruthSample> place_;  // with the time since which it has not changed
  std::optional<Pose> rest_;
};

}  // namespace berth::procedures
