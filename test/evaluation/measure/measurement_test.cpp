// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "common/core/random.h"
#include "evaluation/measure/criterion.h"
#include "evaluation/measure/measurer.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;
using made::mm;

namespace {

/// 20 s of flight with truth at 125 Hz and estimates at 2 Hz, wrong by a constant.
RunRecord flown(const Vector6d& error, double truth_sigma_m = 1e-3) {
  RunRecord record;
  for (int i = 0; i <= 2500; ++i) {
    const Utime t = i * 8 * millisecond;
    record.add(made::truth(made::start + t, made::flight(seconds(t)), truth_sigma_m));
  }
  for (int i = 0; i < 40; ++i) {
    const Utime t = 250 * millisecond + i * 500 * millisecond + 3;  // between truth's samples
    record.add(made::estimate(made::start + t, perturbed(made::flight(seconds(t)), error)));
  }
  record.add(made::state({{"first", 0, 10}, {"second", 10, 20}}));
  return record;
}

double value_of(const RunRecord& record, const std::string& name, Statistic statistic,
                const std::string& phase = whole_run, const NearestPoint& nearest = {}) {
  const Measurement* what = measurement_named(name);
  REQUIRE(what != nullptr);
  const Measurer measurer(record, nearest);
  return measurer.measure(*what, statistic, *record.phase(phase)).value;
}

Vector6d error_of(double x, double y, double z, double about_x, double about_y, double about_z) {
  Vector6d e;
  e << x, y, z, about_x, about_y, about_z;
  return e;
}

}  // namespace

TEST_CASE("a constant error is measured as what it is") {
  const RunRecord record = flown(error_of(3 * mm, -4 * mm, 12 * mm, 0, 0.01, 0));
  CHECK(value_of(record, "position_error", Statistic::rms) == Approx(13 * mm));
  CHECK(value_of(record, "position_error", Statistic::peak) == Approx(13 * mm));
  CHECK(value_of(record, "x_error", Statistic::mean) == Approx(3 * mm));
  CHECK(value_of(record, "y_error", Statistic::mean) == Approx(-4 * mm));
  CHECK(value_of(record, "y_error", Statistic::rms) == Approx(4 * mm));
  CHECK(value_of(record, "z_error", Statistic::deviation) == Approx(0).margin(1e-9));
  CHECK(value_of(record, "attitude_error", Statistic::p95) == Approx(0.01));
  CHECK(value_of(record, "attitude_y_error", Statistic::mean) == Approx(0.01));
  CHECK(value_of(record, "attitude_x_error", Statistic::peak) == Approx(0).margin(1e-9));
  CHECK(value_of(record, "measured_position_error", Statistic::mean) == Approx(13 * mm));
  CHECK(value_of(record, "nees", Statistic::mean) ==
        Approx(169e-6 / (9e-6 + 1e-6) + 1e-4 / (4e-6 + 1e-6)));
}

TEST_CASE("truth is interpolated to the estimate's own time") {
  // Exact estimates of a moving target: any other truth than that of their moment shows.
  const RunRecord record = flown(Vector6d::Zero());
  CHECK(value_of(record, "position_error", Statistic::peak) < 1e-9);
  CHECK(value_of(record, "attitude_error", Statistic::peak) < 1e-9);
}

TEST_CASE("truth is never extrapolated, nor carried over a hole") {
  TruthTrack track;
  for (const int ms : {0, 8, 16, 24, 200, 208}) {
    track.add(sample_of(made::truth(ms * millisecond, made::flight(1e-3 * ms))));
  }
  CHECK_FALSE(track.at(-1));
  CHECK(track.at(0));
  CHECK(track.at(8 * millisecond)->pose.position.z() == made::flight(8e-3).position.z());
  CHECK(track.at(12 * millisecond)->pose.position.z() == Approx(made::flight(12e-3).position.z()));
  CHECK_FALSE(track.at(25 * millisecond));
  CHECK_FALSE(track.at(100 * millisecond));
  CHECK(track.at(204 * millisecond));
  CHECK_FALSE(track.at(209 * millisecond));
}

TEST_CASE("the order of arrival and repeats change nothing") {
  const RunRecord ordered = flown(error_of(1 * mm, 2 * mm, 3 * mm, 0, 0, 0));
  std::vector<pose_estimate_t> estimates;
  std::vector<ground_truth_t> truths;
  const Vector6d error = error_of(1 * mm, 2 * mm, 3 * mm, 0, 0, 0);
  for (int i = 39; i >= 0; --i) {
    const Utime t = 250 * millisecond + i * 500 * millisecond + 3;
    const auto message =
        made::estimate(made::start + t, perturbed(made::flight(seconds(t)), error));
    estimates.push_back(message);
    estimates.push_back(message);
  }
  for (int i = 0; i <= 2500; ++i) {
    const Utime t = ((i * 1009) % 2501) * 8 * millisecond;
    truths.push_back(made::truth(made::start + t, made::flight(seconds(t))));
  }
  RunRecord shuffled;
  shuffled.add(made::state({{"first", 0, 10}, {"second", 10, 20}}));
  for (const auto& message : estimates) shuffled.add(message);
  for (const auto& message : truths) shuffled.add(message);
  const Measurer of_shuffled(shuffled, {});
  const Measurer of_ordered(ordered, {});
  for (const Measurement& what : measurements()) {
    INFO(what.name);
    const auto run = ordered.phase(whole_run);
    const Measured a = of_shuffled.measure(what, Statistic::rms, *run);
    const Measured b = of_ordered.measure(what, Statistic::rms, *run);
    CHECK((a.value == b.value || (std::isnan(a.value) && std::isnan(b.value))));
    CHECK(a.uncertainty == b.uncertainty);
    CHECK(a.samples == b.samples);
    CHECK(a.reason == b.reason);
    // No number is missing without a reason.
    CHECK((!std::isnan(a.value) || !a.reason.empty()));
  }
}

TEST_CASE("phases divide the estimates by their own time") {
  RunRecord record = flown(Vector6d::Zero());
  record.add(made::estimate(made::start + 9999 * millisecond,
                            perturbed(made::flight(9.999), error_of(0, 0, 1, 0, 0, 0))));
  CHECK(value_of(record, "position_error", Statistic::peak, "first") == Approx(1));
  CHECK(value_of(record, "position_error", Statistic::peak, "second") < 1e-9);
  CHECK(value_of(record, "estimates", Statistic::mean, "first") == 21);
  CHECK(value_of(record, "estimates", Statistic::mean) == 41);
  CHECK(value_of(record, "duration", Statistic::mean, "second") == Approx(10));
  CHECK(value_of(record, "update_rate", Statistic::mean, "second") == Approx(2));
}

TEST_CASE("share of time tracking, time to acquire and gaps") {
  RunRecord record;
  const auto at = [](double s) { return made::start + utime_from_seconds(s); };
  record.add(made::state({{"go", 0, 20}}));
  record.add(made::estimate(at(1), Pose{}, pose_estimate_t::ACQUIRING));
  record.add(made::estimate(at(4), Pose{}));
  record.add(made::estimate(at(5), Pose{}));
  record.add(made::estimate(at(5.5), Pose{}, pose_estimate_t::LOST));  // 1.5 s until here
  record.add(made::estimate(at(10), Pose{}));                          // good for 2 s
  record.add(made::estimate(at(19), Pose{}));                          // 1 s to the end
  CHECK(value_of(record, "tracking_share", Statistic::mean) == Approx(4.5 / 20));
  CHECK(value_of(record, "time_to_acquire", Statistic::mean) == Approx(4));
  CHECK(value_of(record, "longest_gap", Statistic::mean) == Approx(9));
  CHECK(value_of(record, "update_rate", Statistic::mean) == Approx(0.2));
}

TEST_CASE("the surface range is that of the nearest point, with truth's uncertainty along it") {
  // A point target 0.5 m in front of the model's origin.
  const NearestPoint nearest = [](const Vector3d&) { return Vector3d(0, 0, -0.5); };
  const RunRecord record = flown(Vector6d::Zero());
  const Vector3d end = made::flight(20) * Vector3d(0, 0, -0.5);
  CHECK(value_of(record, "surface_range", Statistic::final, "second", nearest) ==
        Approx(end.norm()));
  CHECK(value_of(record, "surface_range", Statistic::min, "run", nearest) == Approx(end.norm()));
  const Measurer measurer(record, nearest);
  const Measured m = measurer.measure(*measurement_named("surface_range"), Statistic::final,
                                      *record.phase("second"));
  // 1 mm of position, and 1 mrad at a lever arm of 0.5 m nearly along the line of sight.
  CHECK(m.uncertainty == Approx(1 * mm).epsilon(0.01));
  CHECK(std::isnan(value_of(record, "surface_range", Statistic::final)));
}

TEST_CASE("range and bearing errors") {
  const Pose truth{Vector3d(0, 0, 5), Quaterniond::Identity()};
  RunRecord record;
  for (int i = 0; i < 10; ++i) record.add(made::truth(made::start + i * 10 * millisecond, truth));
  record.add(made::estimate(made::start + 50 * millisecond,
                            {Vector3d(0.05, 0, 5), Quaterniond::Identity()}));
  record.add(made::state({{"go", 0, 0.1}}));
  CHECK(value_of(record, "bearing_error", Statistic::mean) == Approx(std::atan2(0.05, 5)));
  CHECK(value_of(record, "range_error", Statistic::mean) == Approx(std::hypot(0.05, 5) - 5));
}

TEST_CASE("statistics of a known series") {
  const std::vector<double> v = {-3, 1, 2, 4};
  CHECK(compute(Statistic::mean, v) == Approx(1));
  CHECK(compute(Statistic::rms, v) == Approx(std::sqrt(30.0 / 4)));
  CHECK(compute(Statistic::deviation, v) == Approx(std::sqrt((16 + 0 + 1 + 9) / 4.0)));
  CHECK(compute(Statistic::min, v) == -3);
  CHECK(compute(Statistic::max, v) == 4);
  CHECK(compute(Statistic::peak, v) == 4);
  CHECK(compute(Statistic::peak, {-5, 2}) == 5);
  CHECK(compute(Statistic::p50, v) == Approx(2.5));  // of 1 2 3 4
  CHECK(compute(Statistic::p95, v) == Approx(3.85));
  CHECK(compute(Statistic::first, v) == -3);
  CHECK(compute(Statistic::final, v) == 4);
  CHECK(std::isnan(compute(Statistic::rms, {})));
  for (const auto& name : statistic_names()) CHECK(name_of(*statistic_named(name)) == name);
}

TEST_CASE("errors drawn from the covariance give a NEES of six") {
  Random random(1, "nees");
  RunRecord record;
  const Pose truth{Vector3d(0, 0, 5), Quaterniond::Identity()};
  for (int i = 0; i < 4000; ++i) {
    const Utime t = made::start + i * 10 * millisecond;
    record.add(made::truth(t, truth));
    Vector6d error;
    error << random.normal_vector(std::sqrt(9e-6 + 1e-6)),
        random.normal_vector(std::sqrt(4e-6 + 1e-6));
    record.add(made::estimate(t, perturbed(truth, error)));
  }
  record.add(made::state({{"go", 0, 40}}));
  CHECK(value_of(record, "nees", Statistic::mean) == Approx(6).epsilon(0.05));
}

namespace {

criterion_result_t judged(const RunRecord& record, const std::string& limits,
                          const std::string& what = "position_error, statistic: rms") {
  Config config =
      Config::parse("criteria:\n  - {name: c, measurement: " + what + ", " + limits + "}\n", "t");
  const auto read = read_criteria(config);
  return judge(read.at(0), Measurer(record, {}));
}

}  // namespace

TEST_CASE("limits are judged in their units") {
  const RunRecord record = flown(error_of(0, 0, 13 * mm, 0, 0, 0));
  const auto pass = judged(record, "max: 2 cm");
  CHECK(pass.result == criterion_result_t::PASSED);
  CHECK(pass.unit == "mm");
  CHECK(pass.value == Approx(13));
  CHECK(pass.upper_limit == Approx(20));
  CHECK(std::isinf(pass.lower_limit));
  CHECK(margin(pass) == Approx(7));
  CHECK(pass.samples == 40);
  CHECK(pass.uncertainty == Approx(1));
  CHECK(judged(record, "max: 10 mm").result == criterion_result_t::FAILED);
  CHECK(judged(record, "min: 20 mm").result == criterion_result_t::FAILED);
  CHECK(judged(record, "min: 10 mm, max: 16 mm").result == criterion_result_t::PASSED);
  const auto nominal = judged(record, "nominal: 12 mm, min: -4 mm, max: 4 mm");
  CHECK(nominal.value == Approx(1));
  CHECK(nominal.result == criterion_result_t::PASSED);
}

TEST_CASE("what cannot be decided is inconclusive") {
  const Vector6d error = error_of(0, 0, 13 * mm, 0, 0, 0);
  const RunRecord record = flown(error);
  // Truth's uncertainty of the error is 1 mm: 13 mm is within two sigmas of these limits.
  for (const char* limits : {"max: 14 mm", "max: 12 mm", "min: 12 mm", "min: 14 mm"}) {
    const auto result = judged(record, limits);
    CHECK(result.result == criterion_result_t::INCONCLUSIVE);
    CHECK(result.reason == "within truth's own uncertainty of the limit");
  }
  // Truth good to 10 mm cannot decide on 20 mm.
  CHECK(judged(flown(error, 10 * mm), "max: 20 mm").result == criterion_result_t::INCONCLUSIVE);
  CHECK(judged(record, "max: 20 mm, samples: 41").reason == "40 samples, 41 needed");
  CHECK(judged(record, "max: 20 mm, phase: third").reason == "phase 'third' did not run");
  RunRecord blind;
  blind.add(made::state({{"go", 0, 20}}));
  CHECK(judged(blind, "max: 20 mm").reason == "no samples");
  blind.add(made::estimate(made::start + second, Pose{}));
  CHECK(judged(blind, "max: 20 mm").reason == "no truth for any of 1 estimates");
  const auto unmeasured = judged(blind, "max: 20 mm");
  CHECK(std::isnan(unmeasured.value));
  CHECK(unmeasured.result == criterion_result_t::INCONCLUSIVE);
}

TEST_CASE("one failure fails, one inconclusive criterion leaves the verdict inconclusive") {
  const auto with = [](std::initializer_list<std::int8_t> results) {
    std::vector<criterion_result_t> list;
    for (const std::int8_t r : results) {
      list.emplace_back();
      list.back().result = r;
    }
    return outcome_of(list);
  };
  using R = criterion_result_t;
  CHECK(with({}) == procedure_state_t::PASS);
  CHECK(with({R::PASSED, R::PASSED}) == procedure_state_t::PASS);
  CHECK(with({R::PASSED, R::INCONCLUSIVE}) == procedure_state_t::INCONCLUSIVE);
  CHECK(with({R::INCONCLUSIVE, R::FAILED, R::PASSED}) == procedure_state_t::FAIL);
}
