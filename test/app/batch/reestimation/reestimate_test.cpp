// SPDX-License-Identifier: BSD-3-Clause
// Estimating a recorded run again.
#include <fstream>
#include <map>

#include "app/batch/reestimation/batch.h"
#include "app/batch/reestimation/estimator_fold.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/targets/target.h"
#include "evaluation/compare/comparison.h"
#include "logs/file/log_reader.h"
#include "test/app/batch/recorded_run.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;

namespace {

namespace fs = std::filesystem;

struct Recorded {
  TemporaryDirectory folder;
  RunFiles run = made::record_run(folder / "runs");
};

/// Made once: making it is most of the work here.
const Recorded& recorded() {
  static const Recorded run;
  return run;
}

BatchRun again(const fs::path& run_or_log, const fs::path& out, const EstimatorChanges& changes) {
  BatchRequest request;
  request.runs = {run_or_log};
  request.changes = changes;
  request.out = out;
  Batch batch = reestimate(request, {});
  return std::move(batch.runs.at(0));
}

/// All messages but the estimator's, and how many of its own there are on each channel.
struct Content {
  std::string others;
  std::map<std::string, int> own;
};

Content content(const fs::path& log) {
  Content content;
  logs::LogReader reader(log);
  logs::LogEvent event;
  Utime last = 0;
  while (reader.next(event)) {
    CHECK(event.utime >= last);
    last = event.utime;
    if (EstimatorFold::is_output(event)) {
      ++content.own[std::string(event.channel)];
    } else {
      content.others += std::to_string(event.utime) + std::string(event.channel);
      content.others.append(reinterpret_cast<const char*>(event.data.data()), event.data.size());
    }
  }
  CHECK(reader.damaged_bytes() == 0);
  CHECK(reader.missing_events() == 0);
  return content;
}

std::size_t count_of(const evaluation::Change& change) {
  return static_cast<std::size_t>(
      std::count_if(change.rows.begin(), change.rows.end(), [](const auto& row) {
        return row.judgement == evaluation::Judgement::better ||
               row.judgement == evaluation::Judgement::worse;
      }));
}

/// Its rms over the whole run; 0: was not measured.
double value_of(const FinishedRun& run, const std::string& measurement) {
  for (const RunValue& value : run.values) {
    const bool whole = value.phase == evaluation::whole_run && value.statistic == "rms";
    if (whole && value.measurement == measurement) return value.value;
  }
  return 0;
}

}  // namespace

TEST_CASE("The unchanged estimator gives the recorded estimates, bit for bit") {
  TemporaryDirectory folder;
  const BatchRun run = again(recorded().run.directory, folder.path(), {});
  CHECK(run.error.empty());
  CHECK(run.result.recorded > 10);
  CHECK(run.result.estimates - run.result.recorded <= 1);  // of a scan whose estimate came too late
  CHECK(run.result.same == run.result.recorded);
  CHECK(run.result.identical());
  CHECK(run.change.verdict() == "no difference");

  const Content old_log = content(recorded().run.log());
  const Content new_log = content(run.again / "run.lcm");
  CHECK(new_log.others == old_log.others);
  CHECK(new_log.own.at(channels::scan_request) - old_log.own.at(channels::scan_request) <= 1);
  // A run directory like any other, of which the same holds.
  const RunSetup again = RunFiles::open(run.again).setup;
  CHECK(again.target == (run.again / "target" / "radarsat2").string());
  CHECK(load_target(again.target, 0).hash == load_target(recorded().run.setup.target, 0).hash);
  const auto compared_old = evaluation::compare_run(recorded().run.log());
  const auto compared_new = evaluation::compare_run(run.again / "run.lcm");
  REQUIRE(!compared_old.comparison.phases.empty());
  CHECK(compared_new.comparison.outcome == compared_old.comparison.outcome);
}

TEST_CASE("A log is enough: its run directory is not needed") {
  TemporaryDirectory folder;
  fs::copy_file(recorded().run.log(), folder / "alone.lcm");
  const BatchRun run = again(folder / "alone.lcm", folder / "again", {});
  CHECK(run.error == "");
  CHECK(run.result.identical());
  CHECK(run.again.filename() == "alone");
}

TEST_CASE("Another method gives other estimates of the same scans, and is recorded in the log") {
  TemporaryDirectory folder;
  EstimatorChanges changes;
  changes.set = {"tracking.method=icp", "range_gate.far=9 m"};
  const BatchRun run = again(recorded().run.directory, folder.path(), changes);
  CHECK(run.error.empty());
  CHECK(run.result.estimates >= run.result.recorded);
  CHECK(run.result.same < run.result.recorded);
  REQUIRE(run.after.info());
  for (const attachment_t& attachment : run.after.info()->attachments) {
    if (attachment.name != "estimator.yaml") continue;
    CHECK(attachment.content.find("method: icp") != std::string::npos);
    CHECK(attachment.content.find("far: 9 m") != std::string::npos);
  }
  CHECK(run.after.info()->configuration_hash != run.before.info()->configuration_hash);
  for (const auto& estimate : run.after.estimates()) CHECK(estimate.scan_id > 0);

  // The log of the new run is estimated again with its recorded configuration.
  TemporaryDirectory third;
  fs::copy_file(run.again / "run.lcm", third / "new.lcm");
  CHECK(again(third / "new.lcm", third / "again", {}).result.identical());
}

TEST_CASE(
    "A run recorded with methods and keys that are no more is estimated by what replaces them") {
  TemporaryDirectory folder;
  const fs::path old = folder / "old";
  fs::copy(recorded().run.directory, old, fs::copy_options::recursive);
  const std::string present = read_file(old / "config" / "estimator.yaml");
  const auto put = [](std::string text, const std::string& before, const std::string& after) {
    const auto at = text.find(before);
    REQUIRE(at != std::string::npos);
    return text.replace(at, before.size(), after);
  };
  std::string text = put(present, "method: hypotheses",
                         "method: views\n  views: {contenders: 24, least_evidence: 25}");
  text = put(text, "method: likelihood", "method: beam\n  beam: {deskew: true}");
  text = put(text, "  se3:", "  se3:\n    iterations: 3");
  text = put(text, "max_scan_time:", "longest_scan:");
  text += "\nlikelihood: {footprint: false, drop_out: 3 %}\n";
  std::ofstream(old / "config" / "estimator.yaml") << text;
  const BatchRun run = again(old, folder / "again", {});
  CHECK(run.error == "");
  CHECK(run.result.identical());  // it was estimated so, only its record differs
  CHECK_THAT(read_file(run.again / "config" / "estimator.yaml"),
             Catch::Contains("method: hypotheses") && Catch::Contains("method: likelihood") &&
                 Catch::Contains("drop_out") && Catch::Contains("max_scan_time") &&
                 !Catch::Contains("contenders") && !Catch::Contains("footprint") &&
                 !Catch::Contains("iterations"));

  // One's own file with an old key is at fault.
  EstimatorChanges changes;
  changes.config = folder / "own.yaml";
  std::ofstream(changes.config) << put(present, "  se3:", "  se3:\n    iterations: 3");
  CHECK_THAT(
      again(old, folder / "own", changes).error,
      Catch::Contains("estimator.yaml:") && Catch::Contains("target_tracker.se3.iterations"));
}

TEST_CASE("An estimator that acquires later still obeys the commands of its run") {
  TemporaryDirectory folder;
  EstimatorChanges changes;
  changes.set = {"acquisition.hypotheses.min_returns=100000"};
  const BatchRun run = again(recorded().run.directory, folder.path(), changes);
  CHECK(run.error.empty());
  CHECK(run.result.estimates >= run.result.recorded);  // at least one of every scan
  for (const auto& estimate : run.after.estimates()) CHECK(!estimate.ok());
  CHECK(run.change.verdict() == "worse");
}

TEST_CASE("What comes out does not depend on the number of jobs") {
  TemporaryDirectory folder;
  const auto logs_with = [&](unsigned jobs) {
    BatchRequest request;
    request.runs.assign(3, recorded().run.directory);
    request.changes.set = {"tracking.method=icp"};
    request.out = folder / std::to_string(jobs);
    request.jobs = jobs;
    std::string all;
    double shown = 0;
    const Batch batch = reestimate(request, [&](double share) { shown = std::max(shown, share); });
    CHECK(shown == Approx(1));
    for (const BatchRun& run : batch.runs) all += read_file(run.again / "run.lcm");
    // Also in the results, beside what was recorded.
    ResultStore store(request.out / "results.sqlite");
    REQUIRE(store.batches().size() == 1);
    const BatchRecord kept = store.batches().front();
    CHECK(kept.verdict == batch.change.verdict());
    const auto changes = store.changes(kept);
    CHECK(changes.size() == count_of(batch.change));
    const auto runs = store.runs(kept);
    REQUIRE(runs.size() == 6);
    for (std::size_t i = 0; i < runs.size(); ++i) {
      CHECK(runs[i].build == (i % 2 == 0 ? Build::baseline : Build::tonight));
      CHECK(runs[i].case_name == batch.runs[i / 2].again.filename());
      CHECK(runs[i].seed == runs[0].seed);
      CHECK(value_of(runs[i], "position_error") > 0);
    }
    CHECK(value_of(runs[0], "position_error") != value_of(runs[1], "position_error"));
    CHECK(runs[1].details.at("set") == "tracking.method=icp");
    CHECK(fs::exists(request.out / runs[1].directory / "run.lcm"));
    return all + batch.change.verdict();
  };
  CHECK(logs_with(1) == logs_with(3));
}

TEST_CASE("Damage costs no good message") {
  TemporaryDirectory folder;
  std::string log = read_file(recorded().run.log());
  log.resize(log.size() - 5);                  // a tail cut off
  log[log.size() / 2] ^= 0x10;                 // a flipped bit
  for (int i = 0; i < 4; ++i) log[0 + i] = 0;  // a lost header
  std::ofstream(folder / "damaged.lcm", std::ios::binary) << log;
  const BatchRun run = again(folder / "damaged.lcm", folder / "again", {});
  CHECK(run.error == "");
  CHECK(run.result.estimates >= run.result.recorded - 1);
}

TEST_CASE("Wrong input is reported by name, and the other runs go on") {
  TemporaryDirectory folder;
  EstimatorChanges changes;
  const auto error = [&](const std::string& set) {
    changes.set = {set};
    return again(recorded().run.directory, folder / "again", changes).error;
  };
  CHECK_THAT(error("tracking.methud=icp"), Catch::Contains("tracking.methud"));
  CHECK_THAT(error("tracking.method=magic"), Catch::Contains("magic"));
  CHECK_THAT(error("method"), Catch::Contains("KEY=VALUE"));
  CHECK_THROWS_AS(again(folder / "nothing.lcm", folder / "again", {}), InputError);
  ResultStore store(folder / "again" / "results.sqlite");
  const auto runs = store.runs(store.batches().front());
  REQUIRE(runs.size() == 1);
  CHECK(runs[0].outcome == Outcome::error);
  CHECK_THAT(runs[0].error, Catch::Contains("tracking.methud"));
  CHECK(runs[0].values.empty());

  const std::filesystem::path spoilt = folder / "spoilt";
  std::filesystem::copy(recorded().run.directory, spoilt, std::filesystem::copy_options::recursive);
  std::ofstream(spoilt / "run.lcm") << "nothing";
  CHECK(again(spoilt, folder / "again", {}).error == "it holds no scans to estimate from");

  std::ofstream(folder / "empty.lcm");
  BatchRequest request;
  request.runs = {folder / "empty.lcm", recorded().run.directory};
  request.out = folder / "both";
  const Batch batch = reestimate(request, {});
  CHECK(batch.failed());
  CHECK_THAT(batch.runs[0].error, Catch::Contains("RUN_INFO"));
  CHECK(batch.runs[1].error.empty());
  CHECK(batch.runs[1].result.identical());
}
