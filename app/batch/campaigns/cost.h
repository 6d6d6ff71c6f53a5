// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "app/batch/campaigns/runner.h"

namespace berth::campaigns {

/// Adds a line to the campaign's cost.jsonl: what one process and its workers took. Apart from the
/// results, which no clock touches.
///
///     {"machine":"a","jobs":2,"trials":500,"wall_s":3.1,"user_s":5.9,"system_s":0.1}
void note_cost(const Campaign& campaign, const RunnerCost& cost, int jobs);

/// What those lines say together; lines cut short are passed over.
struct CampaignCost {
  double trials = 0;
  double processor_s = 0;
  double fastest = 0;  ///< trials per s of wall time, of the fastest process
  int jobs = 0;        ///< its workers
};
CampaignCost campaign_cost(const std::filesystem::path& directory);

/// "500 trials in 3.1 s: 161.3 a second; 11.8 ms of processor time a trial"
std::string text_of(const RunnerCost& cost);

}  // namespace berth::campaigns
