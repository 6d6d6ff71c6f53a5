// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/verdict.h"
#include "common/core/file.h"
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
  CHECK(notify("(echo \"$BERTH_NIGHT $BERTH_NIGHT_VERDICT\"; cat) >" + file, report,
               directory.path(), "/bin/berth")
            .empty());
  const std::string summary = read_file(file);
  CHECK_THAT(summary, Catch::StartsWith("tonight clean\n"));
  CHECK_THAT(summary, Catch::Contains("CLEAN"));
  CHECK_THAT(notify("exit 7", report, directory.path(), "/bin/berth"),
             Catch::Contains("exit code 7"));
  report.notification = "failed";
  CHECK(report.exit_code() == 2);
}
