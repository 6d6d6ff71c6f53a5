// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/change.h"

#include <cmath>

#include "common/core/config.h"
#include "common/core/random.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;

namespace {

struct Settings {
  double before_noise = 1;  // as a multiple of the estimates' stated sigma
  double after_noise = 1;
  int first_good_after = 0;  // of the estimates
};

/// 60 s of estimates twice a second.
RecordPair made_pair(evaluation::RunRecord& before, evaluation::RunRecord& after,
                     const Settings& settings, std::uint64_t seed = 1) {
  Random random(seed, "change");
  for (Utime t = 0; t <= 60 * second; t += 8 * millisecond) {
    const auto truth = made::truth(made::start + t, made::flight(seconds(t)), 1e-4, 1e-4);
    before.add(truth);
    after.add(truth);
  }
  for (int i = 1; i < 120; ++i) {
    const Utime t = i * second / 2;
    const Pose pose = made::flight(seconds(t));
    for (auto* record : {&before, &after}) {
      const bool old = record == &before;
      const double noise = old ? settings.before_noise : settings.after_noise;
      Vector6d error;
      error << random.normal_vector(0.003 * noise), random.normal_vector(0.002 * noise);
      const Pose estimated = perturbed(pose, error);
      auto message = made::estimate(made::start + t, estimated);
      message.scan_id = i;
      message.last_packet = 3;
      if (!old && i < settings.first_good_after) message.status = pose_estimate_t::ACQUIRING;
      record->add(message);
    }
  }
  const auto state = made::state({{"first", 0, 30}, {"second", 30, 60}});
  before.add(state);
  after.add(state);
  return {&before, &after};
}

Change change_of(const Settings& settings) {
  evaluation::RunRecord before;
  evaluation::RunRecord after;
  return find_change({made_pair(before, after, settings)}, 0.05);
}

const ChangeRow& row(const Change& change, const std::string& phase, const std::string& measurement,
                     const std::string& statistic) {
  for (const ChangeRow& r : change.rows) {
    if (r.phase == phase && r.measurement == measurement && r.statistic == statistic) return r;
  }
  throw std::runtime_error("no row " + phase + " " + measurement);
}

std::string kind_of(const std::string& measurement, const std::string& statistic, double before,
                    double after, const std::vector<Criterion>& criteria = {}) {
  return name_of(kind_of_change(measurement, statistic, before, after, criteria));
}

}  // namespace

TEST_CASE("A noisier estimator is worse, a quieter one better, in every phase") {
  const Change worse = change_of({1, 2, 0});
  CHECK(worse.verdict() == "worse");
  for (const char* phase : {"first", "second", "run"}) {
    const ChangeRow& r = row(worse, phase, "position_error", "rms");
    INFO(phase);
    CHECK(r.judgement == Judgement::worse);
    CHECK(r.unit == "mm");
    CHECK(r.difference.difference == Approx(0.003 * std::sqrt(3) * 1000).margin(1.5));
    CHECK(r.difference.low > 0);
    CHECK(row(worse, phase, "good_estimates", "mean").judgement == Judgement::same);
  }
  CHECK(row(worse, "run", "nees", "mean").judgement == Judgement::worse);
  CHECK(change_of({2, 1, 0}).verdict() == "better");
}

TEST_CASE("Noise alone is no difference") {
  int flagged = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    evaluation::RunRecord before;
    evaluation::RunRecord after;
    const Change change = find_change({made_pair(before, after, {}, seed)}, 0.05);
    if (change.verdict() != "no difference") ++flagged;
  }
  CHECK(flagged <= 3);  // 1 in 20 is what the level allows
}

TEST_CASE("Estimates that are good no more are counted, not compared") {
  const Change change = change_of({1, 1, 31});
  CHECK(change.statuses.at({"OK", "ACQUIRING"}) == 30);
  CHECK(change.statuses.at({"OK", "OK"}) == 89);
  const ChangeRow& good = row(change, "first", "good_estimates", "mean");
  CHECK(good.judgement == Judgement::worse);
  CHECK(good.difference.before == 100);
  CHECK(row(change, "first", "position_error", "rms").difference.pairs == 30);
}

TEST_CASE("Several runs are compared together") {
  std::vector<evaluation::RunRecord> records(6);
  std::vector<RecordPair> pairs;
  for (std::size_t i = 0; i < 6; i += 2) {
    pairs.push_back(made_pair(records[i], records[i + 1], {1, 1.4, 0}, i));
  }
  const Change change = find_change(pairs, 0.05);
  CHECK(change.runs == 3);
  CHECK(row(change, "run", "position_error", "rms").difference.pairs == 3 * 119);
  CHECK(change.verdict() == "worse");
}

TEST_CASE("A change is reported in text and JSON") {
  const Change change = change_of({1, 2, 5});
  const std::string text = text_of(change, 0.05);
  CHECK(text.find("position_error rms") != std::string::npos);
  CHECK(text.find("ACQUIRING") != std::string::npos);
  CHECK(text.find("against truth: worse") != std::string::npos);
  const auto json = json_of(change);
  CHECK(json["verdict"] == "worse");
  CHECK(json["rows"][0]["phase"] == "first");
  CHECK(json["rows"][0]["pairs"] == 56);
  CHECK(json["statuses"].size() == 2);
}

TEST_CASE("what is better depends on what is measured") {
  CHECK(kind_of("position_error", "rms", 3, 2) == "better");
  CHECK(kind_of("x_error", "mean", -0.1, -2) == "worse");
  CHECK(kind_of("update_rate", "value", 2, 3) == "better");
  CHECK(kind_of("tracking_share", "value", 99, 90) == "worse");
  CHECK(kind_of("nees", "mean", 6, 3) == "worse");
  CHECK(kind_of("angular_velocity_z_gain", "value", 1, -1) == "worse");
  CHECK(kind_of("relative_speed", "rms", 20, 30) == "changed");
  // declared, not guessed from a name
  CHECK(kind_of("silently_wrong", "value", 4, 0) == "better");
  CHECK(kind_of("stopping_time", "value", 300, 200) == "better");
  CHECK(kind_of("mount_turn", "value", 0.1, 0.2) == "worse");
  CHECK(kind_of("returns", "mean", 800, 950) == "better");
  CHECK(kind_of("returns", "deviation", 10, 20) == "worse");
  CHECK(kind_of("nees", "p95", 40, 13) == "better");
  CHECK(kind_of("overconfidence", "value", 0.5, 0.9) == "better");
  CHECK(kind_of("of a newer Berth", "value", 1, 2) == "changed");
  CHECK(kind_of(completed_measurement, "value", 0.9, 1) == "better");
}

TEST_CASE("a criterion's nominal value and limits decide what is better") {
  Config config = Config::parse(R"(
criteria:
  - {name: in range, measurement: docking_range, statistic: final, nominal: 3.5 m, min: -30 mm, max: 30 mm}
  - {name: far enough, measurement: surface_range, statistic: min, min: 1 m}
  - {name: gain, measurement: velocity_x_gain, nominal: 1, min: -0.1, max: 0.1}
  - {name: steady, measurement: returns, statistic: deviation, max: 20}
)",
                                "test");
  const auto criteria = read_criteria(config);
  CHECK(kind_of("docking_range", "in range", -20, 2, criteria) == "better");
  CHECK(kind_of("docking_range", "in range", 2, 25, criteria) == "worse");
  CHECK(kind_of("surface_range", "far enough", 1100, 1300, criteria) == "better");
  CHECK(kind_of("velocity_x_gain", "gain", 0.08, -0.01, criteria) == "better");
  CHECK(kind_of("returns", "steady", 5, 15, criteria) == "worse");
}
