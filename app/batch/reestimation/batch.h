// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "app/batch/reestimation/new_run.h"
#include "app/batch/reestimation/reestimate_log.h"
#include "app/batch/result_store.h"
#include "evaluation/compare/change.h"

namespace berth {

/// What is to be estimated again, and how.
struct BatchRequest {
  std::vector<std::filesystem::path> runs;  ///< run directories or logs
  EstimatorChanges changes;
  std::filesystem::path out;  ///< new run directories and results.sqlite are made under it
  int jobs = 0;               ///< runs at a time; 0: as many as there are processors
  double level = 0.05;        ///< of find_change
};

/// One run of a batch.
struct BatchRun {
  std::filesystem::path recorded;  ///< its log
  std::filesystem::path again;     ///< new run directory
  Reestimation result;
  evaluation::RunRecord before;
  evaluation::RunRecord after;
  FinishedRun as_recorded;
  FinishedRun as_again;
  evaluation::Change change;
  std::string error;  ///< of a run that could not be estimated again: all but the paths is empty
};

struct Batch {
  std::vector<BatchRun> runs;  ///< as requested
  evaluation::Change change;   ///< over all of them

  bool failed() const;
  /// Every estimate of every run came out again, number for number.
  bool identical() const;
};

/// Estimates all runs again, and adds them to the results in `out`: each as recorded (build
/// "baseline") and as estimated again ("tonight"), and what changed. The result does not depend on
/// the number of jobs. Each runs in a process of its own: the caller's must have a single thread.
/// @param share_done receives the share of all that is done
Batch reestimate(const BatchRequest& request, const ShareDone& share_done);

}  // namespace berth
