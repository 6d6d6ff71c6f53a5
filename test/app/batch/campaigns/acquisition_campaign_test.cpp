// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/results.h"
#include "app/batch/campaigns/runner.h"
#include "app/batch/campaigns/trial_store.h"
#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::campaigns;

namespace {

const std::string few_trials = R"(experiment: acquisition
trials: 8
block: 3
grid: {returns: [60, 300]}
draw: {attitude: any attitude}
measurements: [position_error, attitude_error, points]
)";

}  // namespace

TEST_CASE("single scans of the replica are acquired, the same for any number of workers") {
  const TemporaryDirectory directory;
  std::string first;
  for (const int jobs : {1, 3}) {
    const Campaign campaign = Campaign::create(parse_manifest(few_trials, "few.yaml"),
                                               directory / ("c" + std::to_string(jobs)), 0);
    RunnerOptions options;
    options.jobs = jobs;
    options.make = [&] { return make_experiment(campaign); };
    run_blocks(campaign, campaign.blocks(), options);
    const Summary summary = merge(campaign);
    CHECK(summary.complete());
    CHECK(summary.broken.empty());
    CHECK(summary.outcomes.at(Outcome::pass) >= 14);  // of 16
    if (jobs == 1) {
      first = read_file(campaign.trials_file());
      std::vector<TrialResult> results;
      for_each_trial(campaign.manifest(), campaign.results_file(),
                     [&](const TrialResult& trial) { results.push_back(trial); });
      for (const TrialResult& result : results) {
        const double expected = result.point == 0 ? 60 : 300;
        CHECK(result.measurement("points") == Approx(expected).margin(0.25 * expected));
        if (result.passed()) CHECK(result.measurement("position_error") < 150);
        REQUIRE(result.attitude.has_value());
      }
      // One of them again, alone.
      const auto again = make_experiment(campaign)->run_again(trial_of(campaign.manifest(), 5),
                                                              directory / "again");
      CHECK(line_of(again) == line_of(results[5]));
      CHECK(std::filesystem::exists(directory / "again" / "scan.xyz"));
    } else {
      CHECK(read_file(campaign.trials_file()) == first);
    }
  }
}
