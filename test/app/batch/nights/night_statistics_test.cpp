// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "app/batch/nights/changes.h"
#include "app/batch/nights/runner.h"
#include "app/batch/nights/verdict.h"
#include "common/core/config.h"
#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::nights;
using evaluation::FamilyOptions;
using evaluation::paired_family;
using evaluation::Test;
using evaluation::TestResult;
using evaluation::unpaired_family;

namespace {

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

/// Tests of a night: many are correlated, some have outliers, some are
/// missing in a few runs.
std::vector<Test> made_up(Random& random, std::size_t groups, std::size_t before,
                          std::size_t after) {
  std::vector<Test> tests;
  for (std::size_t g = 0; g < groups; ++g) {
    std::vector<double> common_before(before);
    std::vector<double> common_after(after);
    for (double& v : common_before) v = random.normal();
    for (double& v : common_after) v = random.normal();
    for (int q = 0; q < 12; ++q) {
      Test test{g, {}, {}, 0};
      const auto draw = [&](double common) {
        const double own = q % 3 == 0 ? std::exp(2 * random.normal()) : random.normal();
        return random.uniform() < 0.05 ? missing : common + own;
      };
      for (const double v : common_before) test.before.push_back(draw(v));
      for (const double v : common_after) test.after.push_back(draw(v));
      tests.push_back(test);
    }
  }
  return tests;
}

bool any_below(const std::vector<TestResult>& answers, double level) {
  for (const TestResult& a : answers) {
    if (a.p <= level) return true;
  }
  return false;
}

/// A run with some values, as read_results makes it.
FinishedRun made_run(const std::string& case_name, Build build, std::uint64_t seed, bool fresh,
                     double position_error, double mean_x) {
  FinishedRun run;
  run.case_name = case_name;
  run.build = build;
  run.seed = seed;
  run.fresh = fresh;
  run.procedure_hash = "p";
  run.outcome = Outcome::pass;
  run.values = {{"run", evaluation::passed_measurement, "value", "", 1, 1},
                {"run", evaluation::completed_measurement, "value", "", 1, 1},
                {"hold", "position_error", "rms", "mm", position_error, 100},
                {"hold", "x_error", "mean", "mm", mean_x, 100}};
  return run;
}

}  // namespace

TEST_CASE("a family of tests keeps its family-wise alpha") {
  const bool paired = GENERATE(true, false);
  Random random(3, paired ? "paired" : "unpaired");
  constexpr double level = 0.1;
  constexpr int nights = 300;
  int flagged = 0;
  for (int night = 0; night < nights; ++night) {
    const auto tests = made_up(random, 3, paired ? 12 : 30, paired ? 12 : 6);
    const FamilyOptions options{300, static_cast<std::uint64_t>(night)};
    flagged +=
        any_below(paired ? paired_family(tests, options) : unpaired_family(tests, options), level);
  }
  // 30 expected; 47 is beyond one in a thousand. Far fewer would mean that it sees nothing.
  CHECK(flagged < 47);
  CHECK(flagged > 8);
}

TEST_CASE("an increase by a tenth is found among many unchanged values") {
  const bool paired = GENERATE(true, false);
  Random random(5, "power");
  auto tests = made_up(random, 3, paired ? 16 : 60, 16);
  Test changed{1, {}, {}, 0.05};
  for (std::size_t i = 0; i < tests[12].before.size(); ++i) {
    changed.before.push_back(random.normal(0.05));
  }
  for (std::size_t i = 0; i < 16; ++i) {
    changed.after.push_back((paired ? changed.before[i] : 0) + 0.1 + random.normal(0.03));
  }
  tests.push_back(changed);
  const auto answers = paired ? paired_family(tests, {}) : unpaired_family(tests, {});
  CHECK(answers.back().p < 0.002);
  CHECK(answers.back().change == Approx(0.1).margin(0.05));
}

TEST_CASE("a change below the minimum effect is none, however consistent, and hides no other") {
  std::vector<Test> tests;
  for (int q = 0; q < 50; ++q) {
    tests.push_back({0, std::vector<double>(16, 1), std::vector<double>(16, 1 + 1e-6), 0.05});
  }
  Random random(1, "real change");
  Test real{0, std::vector<double>(16, 1), {}, 0.05};
  for (int i = 0; i < 16; ++i) real.after.push_back(1.2 + random.normal(0.1));
  tests.push_back(real);
  const auto answers = paired_family(tests);
  CHECK(answers.front().p == 1);
  CHECK(answers.back().p < 0.002);
}

TEST_CASE("too few runs decide nothing") {
  const auto few =
      paired_family({{0, {1, 1, 1, 1, 1, missing, 1, 1}, {2, 2, 2, 2, 2, 2, 2, 2}, 0}}).front();
  CHECK(std::isnan(few.change));
  CHECK(few.p == 1);
  CHECK(unpaired_family({{0, {1, 2, 3}, {9, 9, 9, 9}, 0}}).front().p == 1);
}

TEST_CASE("changes are found pair by pair, as ratios, and named by their kind") {
  Random random(2, "runs");
  Evidence evidence;
  for (std::uint64_t seed = 1; seed <= 14; ++seed) {
    const double luck = std::exp(random.normal(0.5));
    evidence.baseline.push_back(
        made_run("approach", Build::baseline, seed, false, 3 * luck, random.normal(0.01)));
    evidence.tonight.push_back(made_run("approach", Build::tonight, seed, false,
                                        3.3 * luck * std::exp(random.normal(0.02)),
                                        random.normal(0.01)));
  }
  const auto report = find_changes(evidence, 0.002, {});
  REQUIRE(report.changes.size() == 1);
  const FlaggedChange& change = report.changes[0];
  CHECK(change.measurement == "position_error");
  CHECK(change.against == "baseline");
  CHECK(change.kind == "worse");
  CHECK(change.after / change.before == Approx(1.1).margin(0.03));
  CHECK(change.low > 0);
  CHECK(change.runs == 14);

  SECTION("the same runs again: no change") {
    evidence.tonight = evidence.baseline;
    CHECK(find_changes(evidence, 0.002, {}).changes.empty());
  }
  SECTION("an edited procedure is not compared") {
    for (FinishedRun& run : evidence.tonight) run.procedure_hash = "edited";
    const auto none = find_changes(evidence, 0.002, {});
    CHECK(none.comparisons == 0);
    REQUIRE(none.remarks.size() == 1);
  }
  SECTION("a baseline that crashed decides nothing") {
    for (FinishedRun& run : evidence.baseline) {
      run.outcome = Outcome::error;
      run.values.clear();
    }
    CHECK(find_changes(evidence, 0.002, {}).comparisons == 0);
  }
  SECTION("runs that broke off are counted, not measured") {
    for (FinishedRun& run : evidence.tonight) {
      run.outcome = Outcome::fail;
      run.values[1].value = 0;
    }
    const auto broken = find_changes(evidence, 0.002, {});
    REQUIRE(broken.changes.size() == 2);
    for (const FlaggedChange& c : broken.changes) {
      CHECK((c.measurement == evaluation::passed_measurement ||
             c.measurement == evaluation::completed_measurement));
      CHECK(c.kind == "worse");
    }
  }
}

TEST_CASE("fresh seeds are compared with those of the nights before") {
  Random random(4, "nights");
  Evidence evidence;
  for (std::uint64_t seed = 1; seed <= 80; ++seed) {
    evidence.history.push_back(made_run("approach", Build::tonight, seed, true,
                                        3 * std::exp(random.normal(0.05)), random.normal(0.01)));
  }
  for (std::uint64_t seed = 101; seed <= 108; ++seed) {
    evidence.tonight.push_back(made_run("approach", Build::tonight, seed, true,
                                        3 * std::exp(random.normal(0.05)),
                                        0.5 + random.normal(0.01)));
  }
  const auto report = find_changes(evidence, 0.002, {});
  REQUIRE(report.changes.size() == 1);
  CHECK(report.changes[0].against == "history");
  CHECK(report.changes[0].measurement == "x_error");
  CHECK(report.changes[0].kind == "worse");
}

TEST_CASE("an improvement of whatever is measured leaves the night clean") {
  for (const evaluation::Measurement& what : evaluation::measurements()) {
    if (what.direction == evaluation::Direction::neither) continue;
    INFO(what.name);
    const bool larger = what.direction == evaluation::Direction::larger_is_better;
    const double ideal = what.preference(evaluation::Statistic::mean).ideal;
    const double before = larger ? 100 : ideal + 400;
    const double after = larger ? 200 : ideal + 100;
    Evidence evidence;
    Random random(1, what.name);
    for (std::uint64_t seed = 1; seed <= 14; ++seed) {
      const std::string statistic = what.series ? "mean" : "value";
      for (const bool tonight : {false, true}) {
        FinishedRun run =
            made_run("c", tonight ? Build::tonight : Build::baseline, seed, false, 3, 0);
        run.values.resize(2);  // passed, completed
        run.values.push_back({"hold", what.name, statistic, what.unit,
                              (tonight ? after : before) + random.normal(0.01), 100});
        (tonight ? evidence.tonight : evidence.baseline).push_back(run);
      }
    }
    Plan plan;
    plan.cases.resize(1);
    plan.cases[0].name = "c";
    NightReport report;
    report.runs = evidence.tonight;
    report.changes = find_changes(evidence, 0.002, {}, {2000, 1});
    judge(plan, report);
    REQUIRE(report.changes.changes.size() == 1);
    CHECK(report.changes.changes[0].kind == "better");
    CHECK(report.exit_code() == 0);
  }
}

TEST_CASE("as many runs may fail as the plan's probability of failure allows") {
  CHECK(binomial_tail(0, 10, 0) == 1);
  CHECK(binomial_tail(1, 10, 0) == 0);
  CHECK(binomial_tail(1, 2, 0.5) == Approx(0.75));
  CHECK(binomial_tail(10, 10, 0.5) == Approx(std::pow(0.5, 10)));

  Plan plan;
  plan.cases.resize(1);
  plan.cases[0].name = "approach";
  NightReport report;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    report.runs.push_back(made_run("approach", Build::tonight, seed, false, 3, 0));
  }
  judge(plan, report);
  CHECK(report.night.verdict == "clean");
  CHECK(report.exit_code() == 0);

  report.runs[3].outcome = Outcome::fail;
  judge(plan, report);
  CHECK(report.night.verdict == "failed");
  CHECK(report.exit_code() == 1);

  plan.cases[0].may_fail = 0.05;
  judge(plan, report);
  CHECK(report.night.verdict == "clean");

  report.runs[4].outcome = Outcome::error;
  judge(plan, report);
  CHECK(report.night.verdict == "error");
  CHECK(report.exit_code() == 2);

  report.changes.changes.push_back({});
  report.changes.changes[0].kind = "better";
  judge(plan, report);
  CHECK(report.exit_code() == 2);
  report.changes.changes[0].kind = "changed";
  judge(plan, report);
  CHECK(report.night.verdict == "error");  // the worst, as of any runs
  CHECK(report.exit_code() == 2);
  report.runs[4].outcome = Outcome::pass;
  judge(plan, report);
  CHECK(report.night.verdict == "regression");
  CHECK(report.exit_code() == 1);
}
