// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/figure.h"

#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;

namespace {

const std::string criteria =
    "criteria:\n"
    "  - {name: error, claim: below 10 mm, measurement: position_error, statistic: peak, max: 10 "
    "mm}\n"
    "  - {name: turn, measurement: attitude_error, statistic: peak, max: 1 deg}\n";

std::vector<Figure> figures_in(const std::string& chart) {
  Config config = Config::parse(
      criteria + "figures:\n  - name: Figure 9\n    charts:\n      - {" + chart + "}\n", "p.yaml");
  return read_figures(config, read_criteria(config));
}

std::string error_of(const std::string& chart) {
  try {
    figures_in(chart);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

/// The target rests, is moved by 30 mm in z, rests again ... the estimate is off by the square of
/// the rest's number, in mm along x, and has not settled when a rest begins.
RunRecord stepped(int rests, int without_estimate) {
  RunRecord record;
  std::vector<made::MadeStep> steps;
  for (int rest = 0; rest < rests; ++rest) {
    const Pose truth{{0.1, 0, 5 - 0.03 * rest}, Quaterniond::Identity()};
    for (int i = 0; i <= 100; ++i) {
      record.add(made::truth(made::start + rest * 2 * second + i * 10 * millisecond, truth));
    }
    steps.push_back({"static", 2.0 * rest, 2.0 * rest + 1});
    steps.push_back({"step", 2.0 * rest + 1, 2.0 * rest + 2});
    if (rest == without_estimate) continue;
    for (const double t : {0.2, 0.9}) {
      Pose pose = truth;
      pose.position.x() += 1e-3 * rest * rest + (t < 0.5 ? 0.1 : 0.0);
      record.add(made::estimate(made::start + utime_from_seconds(2.0 * rest + t), pose));
    }
  }
  record.add(made::state(steps));
  return record;
}

std::vector<double> shown(const RunRecord& record, const std::string& name) {
  const Measurement& what = *measurement_named(name);
  Series series = what.series(Measurer(record, {}), *record.phase("static"));
  for (double& value : series.value) value = what.shown(value);
  return series.value;
}

}  // namespace

TEST_CASE("a figure names what is drawn, over what, and whose limits") {
  const auto figures = figures_in(
      "draw: [x_step, z_step], phase: static, over: sample, criteria: [error], "
      "levels: {exactly 30 mm: -30 mm}");
  REQUIRE(figures.size() == 1);
  CHECK(figures[0].name == "Figure 9");
  REQUIRE(figures[0].charts.size() == 1);
  const FigureChart& chart = figures[0].charts[0];
  CHECK(chart.title == "x_step, z_step");
  CHECK(chart.phases == std::vector<std::string>{"static"});
  CHECK(chart.by_sample);
  CHECK_FALSE(chart.statistic);
  REQUIRE(chart.levels.size() == 1);
  CHECK(chart.levels[0].second == Approx(-0.03));
  const auto bars = figures_in("draw: [attitude_error], statistic: peak, phases: [a, b]");
  CHECK(bars[0].charts[0].statistic == Statistic::peak);
  CHECK(bars[0].charts[0].phases.size() == 2);
  CHECK(figures_in("draw: [w, p, r]")[0].charts[0].phases.front() == whole_run);
}

TEST_CASE("a figure that cannot be drawn is refused by name") {
  const auto has = [](const std::string& chart, const std::string& words) {
    INFO(chart);
    INFO(error_of(chart));
    CHECK(error_of(chart).find(words) != std::string::npos);
    CHECK(error_of(chart).find("p.yaml:") == 0);
  };
  has("draw: [x_stop]", "found 'x_stop', expected measurements that are series, or x y z w p r");
  has("draw: [update_rate]", "found 'update_rate'");
  has("draw: []", "is empty");
  has("draw: [x_step, attitude_error]", "different units");
  has("draw: [x, w]", "different units");
  has("draw: [x], statistic: rms, phases: [a]", "found 'x'");
  has("draw: [x_step], statistic: rms", "phases");
  has("draw: [x_step], criteria: [eror]", "found 'eror', expected one of: error, turn");
  has("draw: [x_step], criteria: [turn]", "another unit");
  has("draw: [x_step], levels: {a: 3 deg}", "levels.a");
  has("draw: [x_step], colour: red", "colour");
}

TEST_CASE("a step is from the last estimate of a stretch to that of the next") {
  const RunRecord record = stepped(4, -1);
  const auto x = shown(record, "x_step");
  REQUIRE(x.size() == 3);
  for (int i = 0; i < 3; ++i)
    CHECK(x[static_cast<std::size_t>(i)] == Approx(2 * i + 1).margin(1e-6));
  for (const double z : shown(record, "z_step")) CHECK(z == Approx(-30));
  const auto error = shown(record, "position_step_error");
  REQUIRE(error.size() == 3);
  CHECK(error[2] == Approx(5));
  for (const double turn : shown(record, "attitude_step_error"))
    CHECK(turn == Approx(0).margin(1e-9));
}

TEST_CASE("no step is computed over a stretch without an estimate") {
  CHECK(shown(stepped(5, 2), "z_step").size() == 2);
  CHECK(shown(stepped(1, -1), "z_step").empty());
}
