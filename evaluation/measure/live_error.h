// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>

#include "evaluation/measure/measurer.h"
#include "evaluation/run/target_surface.h"

namespace berth::evaluation {

/// The error of the latest estimate that truth has caught up with, while a run goes on. One thread.
class LiveError {
 public:
  void on(const run_info_t& message) { symmetry_ = symmetry_of_run(message); }
  /// One of status OK.
  void on(const pose_estimate_t& message);
  void on(const ground_truth_t& message);

  /// Of the last 10 s or more.
  const TruthTrack& truth() const { return truth_; }
  /// Nothing before the first.
  const std::optional<ComparedEstimate>& latest() const { return latest_; }

 private:
  SymmetryGroup symmetry_;  // of the run's target
  TruthTrack truth_;
  std::deque<EstimateSample> waiting_;  // for truth
  std::optional<ComparedEstimate> latest_;
};

}  // namespace berth::evaluation
