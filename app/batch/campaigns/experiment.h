// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <memory>

#include "app/batch/campaigns/campaign.h"

namespace berth::campaigns {

/// Runs trials, one after the other, in one process. What they share is made once.
class Experiment {
 public:
  virtual ~Experiment() = default;
  /// A function of the trial alone: independent of clocks and of earlier trials. An error in the
  /// trial is its outcome; never throws for one.
  virtual TrialResult run(const Trial& trial) = 0;
  /// The same; also writes files for inspection into `directory`, which is made.
  virtual TrialResult run_again(const Trial& trial, const std::filesystem::path& directory) = 0;
};

/// Of the campaign's manifest: single scans of a target in empty space, or a procedure in the twin.
/// @throws InputError.
std::unique_ptr<Experiment> make_experiment(const Campaign& campaign);

/// Where a worker may leave files while it runs a trial: on the machine that it runs on. Removed
/// when it has ended, however that was.
std::filesystem::path work_directory_of(pid_t worker);

}  // namespace berth::campaigns
