// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/verdict.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/core/file.h"
#include "test/app/batch/made_run.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::nights;

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
