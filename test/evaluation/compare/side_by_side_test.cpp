// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/side_by_side.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;

namespace {

/// A flight of 20 s with an estimate every 250 ms, off by so much along x and wavering a little.
RunRecord flown(double off, Utime late = 0) {
  RunRecord record;
  for (int i = 0; i <= 400; ++i) {
    record.add(made::truth(made::start + i * 50 * millisecond, made::flight(0.05 * i)));
  }
  for (int i = 1; i < 80; ++i) {
    const double t = 0.25 * i + seconds(late);
    Pose pose = made::flight(t);
    pose.position.x() += off + 1e-4 * std::sin(7.0 * i);
    record.add(made::estimate(made::start + utime_from_seconds(t), pose));
  }
  record.add(made::state({{"approach", 0, 12}, {"hold", 12, 20}}));
  return record;
}

const SideBySideRow& row_named(const std::vector<SideBySideRow>& rows, const std::string& phase,
                               const std::string& measurement) {
  for (const SideBySideRow& row : rows) {
    if (row.phase == phase && row.measurement == measurement) return row;
  }
  throw std::runtime_error("no row " + measurement);
}

}  // namespace

TEST_CASE("runs with estimates at the same times are compared in pairs", "[side_by_side]") {
  const RunRecord a = flown(2e-3);
  const RunRecord b = flown(5e-3);
  const Measurer before(a, {});
  const Measurer after(b, {});
  const auto rows = compare_side_by_side({&before, &after});
  for (const char* phase : {"approach", "hold", "run"}) {
    const SideBySideRow& row = row_named(rows, phase, "rms position_error");
    CHECK(row.unit == "mm");
    CHECK(row.values[0] == Approx(2).margin(0.1));
    CHECK(row.values[1] == Approx(5).margin(0.1));
    CHECK_FALSE(row.paired[0]);
    REQUIRE(row.paired[1]);
    CHECK(row.paired[1]->difference == Approx(3).margin(0.05));
    CHECK(row.paired[1]->low > 2.8);
    CHECK(row.paired[1]->high < 3.2);
  }
}

TEST_CASE("runs at other times are compared side by side without an interval", "[side_by_side]") {
  const RunRecord a = flown(2e-3);
  const RunRecord b = flown(5e-3, 7 * millisecond);
  RunRecord without_hold = flown(2e-3);
  without_hold.add([] {
    auto state = made::state({{"approach", 0, 20}});
    state.utime += 100 * second;
    return state;
  }());
  const Measurer first(a, {});
  const Measurer second_run(b, {});
  const Measurer third(without_hold, {});
  const auto rows = compare_side_by_side({&first, &second_run, &third});
  const SideBySideRow& row = row_named(rows, "hold", "rms position_error");
  CHECK_FALSE(row.paired[1]);
  CHECK(std::isnan(row.values[2]));
  const auto json = nlohmann::json::parse(json_of_side_by_side(rows));
  CHECK(json.size() == rows.size());
  CHECK(text_of_side_by_side({"a", "b", "c"}, rows).find("run 3: c") != std::string::npos);
}
