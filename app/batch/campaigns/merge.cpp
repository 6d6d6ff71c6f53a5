// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "app/batch/campaigns/campaign.h"
#include "app/batch/campaigns/results.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

bool is_broken(Outcome outcome) { return outcome == Outcome::error || outcome == Outcome::crashed; }

void count(const std::vector<TrialResult>& results, const Block& block, Summary& summary) {
  std::int64_t expected = block.begin;
  for (const TrialResult& result : results) {
    if (result.index != expected++) throw InputError("the trials are not those of the block");
    ++summary.present;
    ++summary.outcomes[result.outcome];
    if (!result.passed()) ++summary.failures[result.failure];
    if (is_broken(result.outcome)) summary.broken.push_back(result.index);
  }
  if (expected != block.end) throw InputError("trials are missing from the block");
}

void write_summary(const Campaign& campaign, const Summary& summary) {
  ordered_json outcomes = ordered_json::object();
  for (const auto& [outcome, number] : summary.outcomes) outcomes[name_of(outcome)] = number;
  ordered_json missing = ordered_json::array();
  for (const Block& block : summary.missing) missing.push_back({block.begin, block.end});
  const ordered_json json = {{"schema", "berth-campaign-summary-1"},
                             {"name", campaign.manifest().name},
                             {"trials", summary.trials},
                             {"present", summary.present},
                             {"outcomes", outcomes},
                             {"failures", summary.failures},
                             {"missing", missing},
                             {"broken", summary.broken}};
  write_file(campaign.directory() / "summary.json", json_text(json, 2) + "\n");
}

}  // namespace

Summary merge(const Campaign& campaign) {
  Summary summary;
  summary.trials = campaign.manifest().total();
  WholeFile out(campaign.trials_file());  // a block at a time: too long for the memory, maybe
  for (const Block& block : campaign.blocks()) {
    const fs::path file = campaign.block_file(block);
    if (!fs::exists(file)) {
      summary.missing.push_back(block);
      continue;
    }
    try {
      count(read_results(file), block, summary);
    } catch (const InputError& e) {
      throw InputError(file.string() + ": " + e.what() + "; delete it, and the trials run again");
    }
    out.write(read_file(file));
  }
  out.finish();
  write_summary(campaign, summary);
  return summary;
}

}  // namespace berth::campaigns
