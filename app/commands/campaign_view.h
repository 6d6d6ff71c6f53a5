// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>

#include "app/batch/campaigns/runner.h"

namespace berth::commands {

/// How far a campaign is: one line that is rewritten on a terminal, a line now and then in a file.
class CampaignProgress {
 public:
  CampaignProgress();
  void tell(const campaigns::RunnerProgress& progress);
  /// Leaves the line.
  void end();

 private:
  using Clock = std::chrono::steady_clock;
  bool is_terminal_;
  Clock::time_point begun_ = Clock::now();
  Clock::time_point told_{};
};

/// What came of a campaign: each point of the grid, failures by kind, what is broken or missing.
void print_summary(const campaigns::Campaign& campaign, const campaigns::Summary& summary);

}  // namespace berth::commands
