// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "app/batch/reestimation/fold_bus.h"
#include "app/runs/run_files.h"
#include "common/bus/node.h"
#include "common/bus/simulation.h"
#include "logs/file/log_event.h"

namespace berth {

/// The estimator's node alone, fed with recorded messages: the same node as in a cell, on a clock
/// that shows the time of the log. The same messages give the same estimates, to the bit.
///
/// Scans are as recorded: what the estimator asks for is handed out and obeyed by nobody. It uses
/// the recorded scans by their numbers, as it would those of a LIDAR that scans what it likes.
class EstimatorFold {
 public:
  /// @param start the clock's first time
  /// @param outlet sees every message of the node, at the clock's time
  /// @throws InputError for what is wrong in the configuration
  EstimatorFold(const RunFiles& files, Utime start, FoldBus::Outlet outlet);

  /// A message of the log. All that is no input of the estimator only moves the clock.
  void take(const logs::LogEvent& event);
  Utime now() const { return simulation_.now(); }

  /// Whether this is one of the two inputs.
  static bool is_input(const logs::LogEvent& event);
  /// Whether an estimator said this: its four channels, and what every node says of itself.
  static bool is_output(const logs::LogEvent& event);

 private:
  Simulation simulation_;
  FoldBus bus_;
  std::unique_ptr<Node> node_;
};

}  // namespace berth
