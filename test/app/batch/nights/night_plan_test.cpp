// SPDX-License-Identifier: BSD-3-Clause
#include <fstream>
#include <set>

#include "app/batch/nights/index_page.h"
#include "app/batch/nights/plan.h"
#include "common/core/error.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::nights;

namespace {

struct PlanFile {
  TemporaryDirectory directory;
  std::filesystem::path file = directory / "plan.yaml";

  PlanFile() { std::ofstream(directory / "approach.yaml") << "name: approach\n"; }

  Plan load(const std::string& text) const {
    std::ofstream(file) << text;
    return load_plan(file);
  }
  std::string error_of(const std::string& text) const {
    try {
      load(text);
    } catch (const InputError& e) {
      return e.what();
    }
    return "none";
  }
};

}  // namespace

TEST_CASE("an archive is a directory of run directories") {
  const PlanFile plan_file;
  const std::string procedures = "procedures: [{procedure: approach.yaml, seeds: {fixed: 1}}]\n";
  std::filesystem::create_directories(plan_file.directory / "empty");
  std::filesystem::create_directories(plan_file.directory / "runs" / "one");
  CHECK_THAT(plan_file.error_of("archive: {runs: empty}\n" + procedures),
             Catch::Matchers::Contains("plan.yaml:1") &&
                 Catch::Matchers::Contains("expected a directory of run directories"));
  const Plan plan = plan_file.load("archive: {runs: runs}\n" + procedures);
  CHECK(plan.archive.runs.filename() == "runs");
  CHECK(plan.archive.config.empty());
}

TEST_CASE("a plan names procedures, seeds, targets, hosts and configurations") {
  const PlanFile plan_file;
  std::ofstream(plan_file.directory / "envisat.stl") << "solid\n";
  const Plan plan = plan_file.load(R"(
jobs: 3
time_budget: 2 h
seeds: {fixed: 4, fresh: 2}
minimum_effect: {relative: 10 %, length: 0.5 mm}
procedures:
  - procedure: approach.yaml
    may_fail: 5 %
    set: {speed: 30 mm/s, start: [0, 0, 1, 0, 0, 0]}
  - procedure: approach.yaml
    targets: [radarsat2, envisat.stl]
    hosts: simulated-cell
    seeds: {fixed: [7, 9]}
)");
  CHECK(plan.jobs == 3);
  CHECK(plan.time_budget_s == 7200);
  CHECK(plan.minimum_effect.relative == 0.1);
  CHECK(plan.minimum_effect.absolute.at(Dimension::length) == 0.5e-3);
  REQUIRE(plan.cases.size() == 3);
  CHECK(plan.cases[0].name == "approach");
  CHECK(plan.cases[0].fixed == std::vector<std::uint64_t>{1, 2, 3, 4});
  CHECK(plan.cases[0].fresh == 2);
  CHECK(plan.cases[0].may_fail == Approx(0.05));
  CHECK(plan.cases[0].parameters.at("start") == "[0, 0, 1, 0, 0, 0]");
  CHECK(plan.cases[2].name == "approach envisat on simulated-cell");
  CHECK(plan.cases[2].fixed == std::vector<std::uint64_t>{7, 9});
  CHECK(plan.cases[2].fresh == 0);
}

TEST_CASE("an estimator of one's own has cases of its own, and the baseline flies by its own") {
  const PlanFile plan_file;
  std::ofstream(plan_file.directory / "mine.so") << "";
  const Plan plan = plan_file.load(R"(
seeds: {fixed: 2}
procedures:
  - procedure: approach.yaml
  - {procedure: approach.yaml, estimator: mine.so}
)");
  REQUIRE(plan.cases.size() == 2);
  CHECK(plan.cases[0].estimator.empty());
  CHECK(plan.cases[1].name == "approach by mine");
  CHECK(plan.cases[1].estimator == plan_file.directory / "mine.so");
  CHECK_THAT(plan_file.error_of(
                 "seeds: {fixed: 1}\nprocedures: [{procedure: approach.yaml, estimator: no.so}]\n"),
             Catch::Contains("found 'no.so', expected a file"));
  CHECK_THAT(
      plan_file.error_of(
          "seeds: {fixed: 1}\nprocedures: [{procedure: approach.yaml, estimator: ''}]\n"),
      Catch::Contains("plan.yaml:2: key 'procedures[0].estimator'") && Catch::Contains("found ''"));
}

TEST_CASE("each world is a case of its own; measurements are compared in exact alone") {
  const PlanFile plan_file;
  Plan plan = plan_file.load(R"(
seeds: {fixed: 2}
procedures:
  - procedure: approach.yaml
    worlds: [exact, lab]
)");
  REQUIRE(plan.cases.size() == 2);
  CHECK(plan.cases[0].name == "approach");
  CHECK(plan.cases[0].parameters.at("simulation.yaml:world") == "exact");
  CHECK(plan.cases[0].is_compared());
  CHECK(plan.cases[1].name == "approach in lab");
  CHECK(plan.cases[1].parameters.at("simulation.yaml:world") == "lab");
  CHECK_FALSE(plan.cases[1].is_compared());
  plan.baseline.build = "/old/berth";
  CHECK(runs_of_night(plan, 1).size() == 6);  // the baseline need not fly in lab
}

TEST_CASE("errors in a plan name file, line and key") {
  const PlanFile plan_file;
  const auto has = [&](const std::string& text, const std::string& expected) {
    INFO(text);
    const std::string error = plan_file.error_of(text);
    CHECK_THAT(error, Catch::Contains(expected));
    CHECK_THAT(error, Catch::Contains("plan.yaml:"));
  };
  has("jobs: 2\n", "key 'procedures': expected a list");
  has("procedures:\n  - procedure: nothing.yaml\n", ":2: key 'procedures[0].procedure': found");
  has("procedures:\n  - procedure: approach.yaml\n", "no seeds, so it never runs");
  const std::string good = "procedures:\n  - procedure: approach.yaml\n    seeds: {fixed: 3}\n";
  CHECK(plan_file.error_of(good) == "none");
  has(good + "  - procedure: approach.yaml\n    seeds: {fixed: 3}\n", "appears twice in the plan");
  has(good + "tiem_budget: 2 h\n", "did you mean 'time_budget'?");
  has(good + "jobs: 0\n", ":4: key 'jobs': found '0', expected a whole number of at least 1");
  has(good + "family_wise_alpha: 0\n", "expected a number above 0 and below 1");
  has(good + "    hosts: [moon]\n", "expected twin, simulated-cell or cell");
  has(good + "baseline: {build: ../old/berth}\n", "key 'baseline.build': found '../old/berth'");
  has("procedures:\n  - procedure: approach.yaml\n    seeds: {fixed: [1, 1]}\n", "appears twice");
}

TEST_CASE("fixed seeds are the same every night, fresh ones other ones; the baseline is paired") {
  const PlanFile plan_file;
  Plan plan = plan_file.load(
      "seeds: {fixed: 3, fresh: 4}\nprocedures:\n  - procedure: approach.yaml\n"
      "  - procedure: approach.yaml\n    name: second\n");
  const auto fresh = [&](std::int64_t night) {
    std::set<std::uint64_t> seeds;
    for (const PlannedRun& run : runs_of_night(plan, night)) {
      if (run.fresh) seeds.insert(run.seed);
    }
    return seeds;
  };
  CHECK(fresh(1).size() == 8);
  CHECK(fresh(1) == fresh(1));
  for (const std::uint64_t seed : fresh(1)) CHECK(fresh(2).count(seed) == 0);

  CHECK(runs_of_night(plan, 1).size() == 14);
  plan.baseline.build = "/old/berth";
  const auto runs = runs_of_night(plan, 1);
  REQUIRE(runs.size() == 20);
  CHECK(runs[0].name() == "approach-seed1");
  CHECK(runs[1].name() == "second-seed1");
  CHECK(runs[2].name() == "approach-seed1-baseline");
  std::set<std::string> names;
  for (const PlannedRun& run : runs) {
    names.insert(run.name());
    CHECK_FALSE((run.fresh && run.build == Build::baseline));
  }
  CHECK(names.size() == runs.size());
  plan.cases[1].host = "simulated-cell";
  CHECK(runs_of_night(plan, 1).size() == 17);
}

TEST_CASE(
    "a claim keeps its row when the plan changes a configuration file, or when none is read") {
  const PlanFile plan_file;
  std::ofstream(plan_file.directory / "approach.yaml") << R"(
name: approach
parameters:
  limit: 10 mm
steps: [{wait: 1 s}]
criteria:
  - {name: position, claim: "below 20 mm", measurement: position_error, statistic: rms, max: "${limit}"}
)";
  const Plan plan = plan_file.load(R"(
seeds: {fixed: 1}
procedures:
  - procedure: approach.yaml
    set: {limit: 20 mm, "simulation_lidar.yaml:noise_scale": 2}
)");
  NightReport report;
  FinishedRun& run = report.runs.emplace_back();
  run.case_name = "approach";
  run.values = {{"run", "position_error", "position", "mm", 12, 100}};
  const std::string table = claims_table(plan, report).code;
  CHECK_THAT(table, Catch::Contains("below 20 mm"));
  CHECK_THAT(table, Catch::Contains("1 of 1"));
  std::filesystem::remove(plan_file.directory / "approach.yaml");
  CHECK_THAT(claims_table(plan, report).code, Catch::Contains("approach.yaml"));
}
