// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "app/batch/campaigns/campaign.h"

namespace berth::commands {

struct SlurmRequest {
  std::filesystem::path options;  ///< of the cluster; empty: its defaults
  std::int64_t task_trials = 0;   ///< trials of a task; 0: by the options and a trial's time
  bool detach = false;            ///< leave when the jobs are submitted
  /// Runs blocks in this process: the first one, while the time of a trial is unknown.
  std::function<void(const std::vector<campaigns::Block>&)> run_here;
  std::function<bool()> interrupted;
  /// Called when the jobs are submitted, before they are waited for.
  std::function<void()> submitted;
};

enum class SlurmEnd { over, detached, interrupted };

/// Submits what is missing, or finds the jobs that do it already, and waits with progress until
/// they are over; reports the tasks that failed and their logs. The jobs go on when this ends
/// early.
SlurmEnd run_on_slurm(const campaigns::Campaign& campaign, const SlurmRequest& request);

/// Ends the campaign's jobs, if there are any.
void cancel_on_slurm(const campaigns::Campaign& campaign);

}  // namespace berth::commands
