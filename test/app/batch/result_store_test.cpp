// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/result_store.h"

#include <cmath>
#include <fstream>

#include "common/core/error.h"
#include "test/app/batch/made_run.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;

TEST_CASE("a store keeps batches, runs, values and flagged changes") {
  const TemporaryDirectory directory;
  BatchRecord night;
  night.name = "2026-11-21";
  night.begun = "2026-11-21T22:00:00Z";
  night.version = "0.1.0";
  {
    ResultStore history(directory / "history.sqlite");
    history.begin(night);
    CHECK(night.number == 1);
    history.record(night, {made_run(1, false, 2.5)});
    night.wall_s = 12;
    history.record(night, {made_run(77, true, 3.5)});
    // What is recorded twice is a mistake, and leaves nothing behind.
    CHECK_THROWS_AS(history.record(night, {made_run(1, false, 9)}), std::runtime_error);
  }
  ResultStore history(directory / "history.sqlite");
  REQUIRE(history.batches().size() == 1);
  CHECK(history.batches()[0].ended.empty());
  CHECK(history.batches()[0].wall_s == 12);
  auto runs = history.runs(night);
  REQUIRE(runs.size() == 2);
  REQUIRE(runs[0].values.size() == 2);
  CHECK(runs[0].values[0].value == 2.5);
  CHECK(runs[0].values[0].unit == "mm");
  CHECK(std::isnan(runs[0].values[1].value));
  CHECK(history.runs(night, ResultStore::Which::fresh).size() == 1);
  CHECK(history.runs(night, ResultStore::Which::fixed)[0].seed == 1);
  CHECK(history.runs(night, ResultStore::Which::all_without_values)[0].values.empty());
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
  CHECK_FALSE(history.batches()[0].good());
  REQUIRE(history.changes(night).size() == 1);
  CHECK(history.changes(night)[0].p == 0.001);
  CHECK(history.trend(1, "approach", "hold", "position_error", "rms").size() == 2);

  CHECK_THROWS_AS(history.accept("2026-01-01"), InputError);
  history.accept(night.name);
  CHECK(history.batch_named(night.name)->good());
}

TEST_CASE("what only a front end knows of a run is kept beside the nights' schema") {
  const TemporaryDirectory directory;
  ResultStore store(directory / "results.sqlite");
  BatchRecord batch;
  batch.name = store.free_name("approach");
  store.begin(batch);
  const auto tables = [&] {
    Database file(directory / "results.sqlite");
    Statement names = file.prepare("SELECT name FROM sqlite_master WHERE type = 'table'");
    std::string all;
    while (names.step()) all += names.text() + " ";
    return all;
  };
  store.record(batch, {made_run(1, false, 2)});
  CHECK(tables() == "night run quantity value change ");
  FinishedRun run = made_run(2, false, 3);
  run.details = {{"parameters.returns", "35"}, {"failure", "it's \"lost\""}};
  store.record(batch, {run, made_run(3, false, 4)});
  CHECK(tables() == "night run quantity value change detail ");
  const auto runs = store.runs(batch);
  REQUIRE(runs.size() == 3);
  CHECK(runs[0].details.empty());
  CHECK(runs[1].details == run.details);
  CHECK(runs[2].details.empty());
  CHECK(runs[2].values[0].value == 4);
  CHECK(store.free_name("approach") == "approach-2");
  // All of a record or nothing.
  CHECK_THROWS_AS(store.record(batch, {made_run(4, false, 1), made_run(1, false, 1)}),
                  std::runtime_error);
  CHECK(store.runs(batch).size() == 3);
}

TEST_CASE("a file that is no store of results, or one of a newer Berth, is refused by name") {
  const TemporaryDirectory directory;
  std::ofstream(directory / "text.sqlite") << std::string(5000, 'x');
  CHECK_THROWS_WITH(ResultStore(directory / "text.sqlite"), Catch::Contains("text.sqlite"));
  { Database(directory / "newer.sqlite").execute("PRAGMA user_version = 99"); }
  CHECK_THROWS_WITH(ResultStore(directory / "newer.sqlite"), Catch::Contains("newer Berth"));
}
