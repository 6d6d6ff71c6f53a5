// SPDX-License-Identifier: BSD-3-Clause
// The report of a campaign of made-up results, whose truth is known.
#include "app/batch/campaigns/report.h"

#include <chrono>
#include <nlohmann/json.hpp>

#include "app/batch/campaigns/report_table.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "test/app/batch/campaigns/made_campaign.h"
#include "test/catch.h"

namespace berth::campaigns {
namespace {

namespace fs = std::filesystem;

struct Directory {
  fs::path path = fs::temp_directory_path() / ("berth-campaign-report-" + std::to_string(getpid()));
  Directory() { fs::remove_all(path); }
  ~Directory() { fs::remove_all(path); }
};

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t number = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++number;
  return number;
}

TEST_CASE("a report shows the values that were put into the results") {
  const Directory directory;
  const Manifest manifest = made_manifest(200);
  make_trials(manifest, directory.path);
  write_report(manifest, directory.path);

  const auto json = nlohmann::json::parse(read_file(directory.path / "report.json"));
  CHECK(json["all"]["trials"] == 2000);
  // Directions within acos 0.97 of +x and -x are 3 % of all.
  CHECK(json["failures"]["lost"].get<double>() == Approx(60).margin(30));
  REQUIRE(json["sweeps"].size() == 3);
  const auto& returns = json["sweeps"][0];
  CHECK(returns["parameter"] == "returns");
  REQUIRE(returns["series"].size() == 2);  // by range_noise
  for (const auto& series : returns["series"]) {
    REQUIRE(series["groups"].size() == 5);
    double before = INFINITY;
    for (const auto& group : series["groups"]) {
      CHECK(group["trials"] == 200);
      CHECK(group["success"]["low"] <= group["success"]["value"]);
      CHECK(group["success"]["value"] <= group["success"]["high"]);
      const double median = group["measurements"]["position_error"]["median"]["value"];
      CHECK(median < before);
      before = median;
    }
  }
  const auto& drawn = json["sweeps"][2];
  CHECK(drawn["parameter"] == "range");
  CHECK(drawn["unit"] == "m");
  std::size_t trials = 0;
  for (const auto& group : drawn["series"][0]["groups"])
    trials += group["trials"].get<std::size_t>();
  CHECK(trials == 2000);

  const std::string page = read_file(directory.path / "report.html");
  CHECK(page.find("Figure 7") != std::string::npos);
  CHECK(page.find("berth campaign trial") != std::string::npos);
  CHECK(count(page, "<figure class=\"sphere\"") == 7);  // five returns, errors, coverage
  CHECK(page.find("nan") == std::string::npos);
  CHECK(page.find("http") == page.find("http-equiv"));  // fetches nothing
}

TEST_CASE("a table of trials has the values and effects of its made results") {
  const Manifest manifest = made_manifest(100);
  TrialTable table(manifest);
  for (std::int64_t i = 0; i < manifest.total(); ++i) table.add(made_result(manifest, i));
  REQUIRE(table.parameters.size() == 3);
  CHECK(table.parameters[0].levels == std::vector<std::string>{"50", "100", "500", "1000", "3000"});
  CHECK(table.parameters[1].unit == "mm");
  CHECK(table.parameters[2].levels.empty());
  for (const double range : table.parameters[2].values) CHECK((range >= 4 && range <= 6));
  CHECK(table.attitude.size() == table.size());

  for (const Sweep& sweep : sweeps_of(table)) {
    std::vector<bool> seen(table.size());
    for (const auto& series : sweep.series) {
      for (const Group& group : series.groups) {
        for (const std::size_t row : group.rows) {
          CHECK_FALSE(seen[row]);
          seen[row] = true;
        }
      }
    }
    CHECK(std::count(seen.begin(), seen.end(), true) == static_cast<int>(table.size()));
    CHECK(sweep.logarithmic == (sweep.parameter == "returns"));
  }
}

TEST_CASE("no results and no trials are distinguished") {
  const Directory directory;
  Manifest manifest = made_manifest(1);
  manifest.trials = 0;
  fs::create_directories(directory.path);
  CHECK_THROWS_WITH(write_report(manifest, directory.path),
                    Catch::Contains("results.sqlite: is missing"));
  make_trials(manifest, directory.path);
  write_report(manifest, directory.path);
  CHECK(read_file(directory.path / "report.html").find("0 of 0 trials") != std::string::npos);
}

TEST_CASE("a hundred thousand trials", "[.size]") {
  const fs::path directory = "/tmp/berth-campaign-100000";
  const Manifest manifest = made_manifest(10000);
  make_trials(manifest, directory);
  const auto begun = std::chrono::steady_clock::now();
  write_report(manifest, directory);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  WARN(took.count() << " s, " << fs::file_size(directory / "report.html") / 1000 << " kB");
}

}  // namespace
}  // namespace berth::campaigns
