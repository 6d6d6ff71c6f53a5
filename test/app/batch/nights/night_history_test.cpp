// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/batch/nights/history.h"
#include "app/batch/nights/verdict.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::nights;

namespace {

FinishedRun made_run(std::uint64_t seed, bool fresh, double value) {
  FinishedRun run;
  run.case_name = "approach";
  run.seed = seed;
  run.fresh = fresh;
  run.outcome = Outcome::pass;
  run.directory = "runs/approach-seed" + std::to_string(seed);
  run.values = {{"hold", "position_error", "rms", "mm", value, 12},
                {"hold", "x_error", "mean", "mm", std::nan(""), 0}};
  return run;
}

}  // namespace

TEST_CASE("a history keeps nights, runs, values and flagged changes") {
  const TemporaryDirectory directory;
  Night night;
  night.name = "2026-11-21";
  night.begun = "2026-11-21T22:00:00Z";
  night.version = "0.1.0";
  {
    History history(directory / "history.sqlite");
    history.begin(night);
    CHECK(night.number == 1);
    history.record(night, made_run(1, false, 2.5));
    night.wall_s = 12;
    history.record(night, made_run(77, true, 3.5));
    // What is recorded twice is a mistake, and leaves nothing behind.
    CHECK_THROWS_AS(history.record(night, made_run(1, false, 9)), std::runtime_error);
  }
  History history(directory / "history.sqlite");
  REQUIRE(history.nights().size() == 1);
  CHECK(history.nights()[0].ended.empty());
  CHECK(history.nights()[0].wall_s == 12);
  auto runs = history.runs(night);
  REQUIRE(runs.size() == 2);
  REQUIRE(runs[0].values.size() == 2);
  CHECK(runs[0].values[0].value == 2.5);
  CHECK(runs[0].values[0].unit == "mm");
  CHECK(std::isnan(runs[0].values[1].value));
  CHECK(history.runs(night, History::Which::fresh).size() == 1);
  CHECK(history.runs(night, History::Which::fixed)[0].seed == 1);
  CHECK(history.runs(night, History::Which::all_without_values)[0].values.empty());
  CHECK(history.trend(1, "approach", "hold", "position_error", "rms").empty());  // still open

  history.forget_directory(night, "runs/approach-seed1");
  CHECK(history.runs(night)[0].directory.empty());

  FlaggedChange change;
  change.case_name = "approach";
  change.p = 0.001;
  change.kind = "worse";
  night.ended = "2026-11-21T23:00:00Z";
  night.verdict = "regression";
  history.finish(night, {change});
  CHECK_FALSE(history.nights()[0].good());
  REQUIRE(history.changes(night).size() == 1);
  CHECK(history.changes(night)[0].p == 0.001);
  CHECK(history.trend(1, "approach", "hold", "position_error", "rms").size() == 2);

  CHECK_THROWS_AS(history.accept("2026-01-01"), InputError);
  history.accept(night.name);
  CHECK(history.night_named(night.name)->good());
}

TEST_CASE("a file that is no history, or one of a newer Berth, is refused by name") {
  const TemporaryDirectory directory;
  std::ofstream(directory / "text.sqlite") << std::string(5000, 'x');
  CHECK_THROWS_WITH(History(directory / "text.sqlite"), Catch::Contains("text.sqlite"));
  { Database(directory / "newer.sqlite").execute("PRAGMA user_version = 99"); }
  CHECK_THROWS_WITH(History(directory / "newer.sqlite"), Catch::Contains("newer Berth"));
}

TEST_CASE("a notification has the summary and the verdict; its failure is reported") {
  const TemporaryDirectory directory;
  NightReport report;
  report.night.name = "tonight";
  report.night.verdict = "clean";
  const std::string file = (directory / "said.txt").string();
  CHECK(notify("(echo \"$BERTH_NIGHT $BERTH_NIGHT_VERDICT\"; cat) >" + file, report, "/bin/berth")
            .empty());
  const std::string summary = read_file(file);
  CHECK_THAT(summary, Catch::StartsWith("tonight clean\n"));
  CHECK_THAT(summary, Catch::Contains("CLEAN"));
  CHECK_THAT(notify("exit 7", report, "/bin/berth"), Catch::Contains("exit code 7"));
  report.notification = "failed";
  CHECK(report.exit_code() == 2);
}

TEST_CASE("a night's tables are the same in its text, JSON and JUnit") {
  NightReport report;
  report.night.name = "tonight";
  report.night.verdict = "regression";
  report.runs = {made_run(1, false, 2.5), made_run(7, true, 3.5), made_run(8, true, 3.5)};
  report.runs[1].outcome = Outcome::fail;
  report.runs[1].error = "a criterion was not met";
  report.runs[2].outcome = Outcome::error;
  const std::string name = report.runs[0].case_name;
  CaseResult result;
  result.name = name;
  result.runs = 3;
  result.may_fail = 0.25;
  report.cases = {result};
  FlaggedChange change;
  change.case_name = name;
  change.against = "baseline";
  change.phase = "hold";
  change.measurement = "position_error";
  change.statistic = "rms";
  change.unit = "mm";
  change.before = 2;
  change.after = 3;
  change.low = 0.5;
  change.high = 1.5;
  change.p = 0.00125;
  change.kind = "worse";
  report.changes.changes = {change};
  report.archive.runs = {{"old", "", 5, 5, "no difference"}, {"older", "no log", 0, 0, ""}};

  const auto json = nlohmann::ordered_json::parse(json_of(report));
  CHECK(json.at("changes").dump() ==
        R"([{"kind":"worse","against":"baseline","case":")" + name +
            R"(","phase":"hold","measurement":"position_error","statistic":"rms","unit":"mm",)"
            R"("before":2.0,"after":3.0,"difference_low":0.5,"difference_high":1.5,)"
            R"("chance":0.00125,"runs":0}])");
  CHECK(json.at("cases")[0].at("may_fail") == 0.25);
  CHECK(json.at("cases")[0].at("too_many_failed") == false);
  REQUIRE(json.at("runs").size() == 3);
  CHECK(json.at("runs")[1].at("seed") == 7);
  CHECK(json.at("runs")[1].at("fresh") == true);
  CHECK(json.at("archive").at("runs")[1].dump() ==
        R"({"run":"older","error":"no log","verdict":"","estimates":0,"estimates_same":0})");

  const std::string text = text_of(report);
  CHECK_THAT(text, Catch::Contains("+50.0 % [25.0, 75.0]") && Catch::Contains("0.00125") &&
                       Catch::Contains("seed 7") && !Catch::Contains("seed 1"));
  const std::string xml = junit_of(report);
  CHECK_THAT(xml, Catch::Contains("name=\"against the baseline: " + name +
                                  ", hold: position_error (rms)\"") &&
                      Catch::Contains("<failure message=\"change worse; against baseline; ") &&
                      Catch::Contains("tests=\"4\" failures=\"1\" errors=\"1\" skipped=\"1\""));
  CHECK_THAT(xml, Catch::Contains("<skipped message=\"outcome FAIL; ") &&
                      Catch::Contains("reason a criterion was not met"));
  CHECK_THAT(xml,
             Catch::Contains("<testcase classname=\"archive\" name=\"old\" time=\"0.000\"/>") &&
                 Catch::Contains("<error message=\"against truth ERROR: no log; "));
}
