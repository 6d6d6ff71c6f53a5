// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/runner.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <sstream>

#include "app/batch/campaigns/results.h"
#include "app/batch/campaigns/trial_store.h"
#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::campaigns;
namespace fs = std::filesystem;

namespace {

const std::string manifest_text = R"(experiment: acquisition
trials: 20
block: 7
trial_limit: 0.2 s
grid: {returns: [50, 100, 200]}
draw: {attitude: any attitude}
measurements: [position_error]
)";

Manifest manifest() { return parse_manifest(manifest_text, "few.yaml"); }

/// What happens in a trial, apart from its result.
using Happening = std::function<void(const Trial&)>;

/// A number that follows from the trial; no estimator.
class Numbers : public Experiment {
 public:
  explicit Numbers(Happening happening) : happening_(std::move(happening)) {}
  TrialResult run(const Trial& trial) override {
    if (happening_) happening_(trial);
    TrialResult result = result_for(trial);
    Random random(trial.seed, "numbers");
    result.measurements["position_error"] = random.uniform();
    result.outcome = random.uniform() < 0.8 ? Outcome::pass : Outcome::fail;
    if (!result.passed()) result.failure = "lost";
    return result;
  }
  TrialResult run_again(const Trial& trial, const fs::path&) override { return run(trial); }

 private:
  Happening happening_;
};

RunnerOptions options_with(int jobs, Happening happening = {}) {
  RunnerOptions options;
  options.jobs = jobs;
  options.make = [happening] { return std::make_unique<Numbers>(happening); };
  return options;
}

RunnerCost run_all(const Campaign& campaign, const RunnerOptions& options) {
  return run_blocks(campaign, campaign.missing_blocks(), options);
}

/// trials.jsonl of a campaign that nothing happened to.
std::string undisturbed(int jobs) {
  const TemporaryDirectory directory;
  const Campaign campaign = Campaign::create(manifest(), directory / "c", 0);
  run_all(campaign, options_with(jobs));
  CHECK(merge(campaign).complete());
  return read_file(campaign.trials_file());
}

std::vector<TrialResult> trials_of(const Campaign& campaign) {
  std::vector<TrialResult> trials;
  for_each_trial(campaign.manifest(), campaign.results_file(),
                 [&](const TrialResult& trial) { trials.push_back(trial); });
  return trials;
}

std::int64_t lines_in(const fs::path& file) {
  const std::string text = fs::exists(file) ? read_file(file) : "";
  return std::count(text.begin(), text.end(), '\n');
}

/// Counts in a file, over all processes.
void count_in(const fs::path& file) { std::ofstream(file, std::ios::app) << "x\n"; }

}  // namespace

TEST_CASE("a campaign's results are the same bytes for one worker and for eight") {
  const std::string one = undisturbed(1);
  CHECK(std::count(one.begin(), one.end(), '\n') == 60);
  CHECK(undisturbed(8) == one);
}

TEST_CASE("a trial that crashes costs that trial, not the campaign") {
  const TemporaryDirectory directory;
  const Campaign campaign = Campaign::create(manifest(), directory / "c", 0);
  run_all(campaign, options_with(2, [](const Trial& trial) {
            if (trial.index == 9) raise(SIGSEGV);
            if (trial.index == 13) std::abort();  // the last one of its block
            if (trial.index == 30) _exit(1);
          }));
  const Summary summary = merge(campaign);
  CHECK(summary.complete());
  CHECK(summary.broken == std::vector<std::int64_t>{9, 13, 30});
  CHECK(summary.failures.at("SIGSEGV") == 1);
  const auto results = trials_of(campaign);
  CHECK(results[9].outcome == Outcome::crashed);
  CHECK(results[9].seed == trial_of(campaign.manifest(), 9).seed);
  CHECK(results[13].failure == "SIGABRT");
  CHECK(results[30].failure == "exit code 1");
  CHECK(results[30].error == "the worker ended with exit code 1");
  std::istringstream lines(undisturbed(1));
  std::string line;
  for (std::size_t i = 0; std::getline(lines, line); ++i) {
    if (i != 9 && i != 13 && i != 30) CHECK(line_of(results[i]) == line);
  }
}

TEST_CASE("a trial that takes too much processor time is ended") {
  const TemporaryDirectory directory;
  const Campaign campaign = Campaign::create(manifest(), directory / "c", 1);
  run_all(campaign, options_with(1, [](const Trial& trial) {
            for (volatile bool busy = trial.index == 1; busy;) {
            }
          }));
  CHECK(merge(campaign).broken == std::vector<std::int64_t>{1});
  CHECK(trials_of(campaign)[1].failure == "too much processor time");
}

TEST_CASE("a worker that is killed is replaced, and no trial is lost") {
  const TemporaryDirectory directory;
  const Campaign campaign = Campaign::create(manifest(), directory / "c", 0);
  const fs::path ran = directory / "ran";
  const RunnerCost cost = run_all(campaign, options_with(2, [&](const Trial& trial) {
                                    count_in(ran);
                                    const fs::path once = directory / "killed";
                                    if (trial.index != 17 || fs::exists(once)) return;
                                    count_in(once);
                                    raise(SIGKILL);
                                  }));
  CHECK(cost.trials == 60);
  CHECK(lines_in(ran) == 61);
  CHECK(merge(campaign).complete());
  CHECK(read_file(campaign.trials_file()) == undisturbed(1));
}

TEST_CASE("a block that another process computes is not begun, and stays as it is") {
  const TemporaryDirectory directory;
  const Campaign campaign = Campaign::create(manifest(), directory / "c", 0);
  const Block first = campaign.missing_blocks().front();
  const fs::path file = campaign.started_file(first);
  const int other = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  REQUIRE(flock(other, LOCK_EX | LOCK_NB) == 0);
  REQUIRE(write(other, "half a li", 9) == 9);
  CHECK_THROWS_WITH(run_blocks(campaign, {first}, options_with(1)),
                    Catch::Matchers::Contains("another berth is at work on these trials"));
  CHECK(read_file(file) == "half a li");
  close(other);
  run_blocks(campaign, {first}, options_with(1));
  CHECK(fs::exists(campaign.block_file(first)));
}

TEST_CASE("what is killed with its workers goes on where it was") {
  const TemporaryDirectory directory;
  const Campaign campaign = Campaign::create(manifest(), directory / "c", 0);
  const fs::path ran = directory / "ran";
  const pid_t runner = fork();
  if (runner == 0) {
    run_all(campaign, options_with(2, [&](const Trial& trial) {
              count_in(ran);
              if (trial.index == 40) kill(getppid(), SIGKILL);
              if (trial.index >= 40) pause();
            }));
    _exit(0);
  }
  int status = 0;
  REQUIRE(waitpid(runner, &status, 0) == runner);
  REQUIRE(WIFSIGNALED(status));
  // The runner's workers die with it; only then may others take their blocks.
  const Campaign again = Campaign::create(manifest(), directory / "c", 0);
  const auto before = lines_in(ran);
  CHECK(before >= 28);
  // A power cut leaves less than whole lines.
  const Block cut = again.missing_blocks().back();
  std::ofstream(again.started_file(cut)) << R"({"trial":)";
  CHECK_FALSE(merge(again).complete());
  run_all(again, options_with(2, [&](const Trial&) { count_in(ran); }));
  CHECK(merge(again).complete());
  CHECK(read_file(again.trials_file()) == undisturbed(1));
  CHECK(lines_in(ran) <= 60 + 2 * 7);  // two blocks were under way
}

TEST_CASE("an interrupted campaign reports the missing trials, and resumes") {
  const TemporaryDirectory directory;
  const Campaign campaign = Campaign::create(manifest(), directory / "c", 0);
  RunnerOptions options = options_with(1, [](const Trial& trial) {
    if (trial.index == 15) pause();
  });
  std::int64_t done = 0;
  options.report = [&](const RunnerProgress& progress) { done = progress.done; };
  options.interrupted = [&] { return done >= 15; };
  run_all(campaign, options);
  const Summary summary = merge(campaign);
  CHECK(summary.present == 14);
  CHECK(summary.missing.front().begin == 14);
  CHECK(std::ssize(summary.missing) == 7);
  run_all(campaign, options_with(1));
  CHECK(merge(campaign).complete());
  CHECK(read_file(campaign.trials_file()) == undisturbed(1));
}

TEST_CASE("more trials can be requested later; existing ones are kept") {
  const TemporaryDirectory directory;
  const Campaign few = Campaign::create(manifest(), directory / "c", 5);
  run_all(few, options_with(1));
  merge(few);
  const Campaign more = Campaign::create(manifest(), directory / "c", 20);
  const RunnerCost cost = run_all(more, options_with(1));
  CHECK(cost.trials < 60);
  CHECK(merge(more).complete());
  CHECK(read_file(more.trials_file()) == undisturbed(1));
}

TEST_CASE("a directory of another campaign is refused") {
  const TemporaryDirectory directory;
  Campaign::create(manifest(), directory / "c", 0);
  const Manifest other = parse_manifest("seed: 9\n" + manifest_text, "few.yaml");
  CHECK_THROWS_WITH(Campaign::create(other, directory / "c", 0),
                    Catch::Matchers::Contains("another manifest"));
  fs::create_directories(directory / "mine");
  std::ofstream(directory / "mine" / "letter.txt") << "dear";
  CHECK_THROWS_WITH(Campaign::create(manifest(), directory / "mine", 0),
                    Catch::Matchers::Contains("is no campaign"));
}
