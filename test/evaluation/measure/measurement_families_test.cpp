// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <functional>
#include <set>

#include "common/core/file.h"
#include "common/core/random.h"
#include "common/targets/target.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/measure/truth_join.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;
using made::mm;

namespace {

constexpr double period_s = 0.5;  // of the estimates

using Path = std::function<Pose(double)>;
using Change = std::function<void(double t, pose_estimate_t& estimate)>;

Velocity velocity_on(const Path& path, double t) {
  return velocity_between(path(t - 1e-4), path(t + 1e-4), 2e-4);
}

/// Truth at 125 Hz along the path and true estimates at 2 Hz, changed by the test.
RunRecord flown(const Path& path, double duration_s, const Change& change = {},
                double truth_sigma_m = 1 * mm) {
  RunRecord record;
  for (double t = 0; t <= duration_s; t += 0.008) {
    const Utime utime = made::start + utime_from_seconds(t);
    record.add(made::truth(utime, path(t), truth_sigma_m));
  }
  for (double t = period_s / 2; t < duration_s; t += period_s) {
    auto estimate = made::estimate(made::start + utime_from_seconds(t), path(t));
    const Velocity v = velocity_on(path, t);
    Vector3d::Map(estimate.linear_velocity_m_s) = v.linear;
    Vector3d::Map(estimate.angular_velocity_rad_s) = v.angular;
    if (change) change(t, estimate);
    record.add(estimate);
  }
  record.add(made::state({{"go", 0, duration_s}}));
  return record;
}

Measured measured(const RunRecord& record, const std::string& name,
                  Statistic statistic = Statistic::rms) {
  const Measurement* what = measurement_named(name);
  REQUIRE(what != nullptr);
  return Measurer(record, {}).measure(*what, statistic, *record.phase("go"));
}

/// 200 mm/s to and fro over 400 mm, with pauses of no length.
Pose to_and_fro(double t) {
  const double saw = std::abs(std::fmod(t, 4.0) - 2.0);  // 2 .. 0 .. 2
  return {Vector3d(0.2 * saw - 0.2, 0, 5), Quaterniond::Identity()};
}

Pose straight_on(double t) { return {Vector3d(0.2 * t, 0, 5), Quaterniond::Identity()}; }

Pose tumbling(double t) {
  return {Vector3d(0, 0, 5), rotation_from_vector({0, radians(3.0) * t, 0})};
}

Pose resting(double) { return {Vector3d(0.1, 0.2, 5), Quaterniond::Identity()}; }

void shift(pose_estimate_t& estimate, const Vector3d& by) {
  for (int i = 0; i < 3; ++i) estimate.position_m[i] += by(i);
}

}  // namespace

TEST_CASE("a time stamp wrong by a millisecond shows at 200 mm/s, whatever the offset") {
  Random random(3, "time");
  const auto late = [&](double t, pose_estimate_t& estimate) {
    const Pose earlier = to_and_fro(t - 1e-3);
    set_pose(earlier, estimate);
    shift(estimate, Vector3d(5 * mm, -3 * mm, 0) + random.normal_vector(1 * mm));
    Vector3d::Map(estimate.measured_position_m) = earlier.position + random.normal_vector(2 * mm);
  };
  const RunRecord record = flown(to_and_fro, 200, late);
  const Measured filtered = measured(record, "estimate_delay");
  CHECK(filtered.uncertainty < 0.4 * mm);
  CHECK(std::abs(filtered.value - 1 * mm) < 3 * filtered.uncertainty);
  CHECK(std::abs(filtered.value) > 2 * filtered.uncertainty);
  CHECK(filtered.reason.empty());
  const Measured scans = measured(record, "lidar_to_arms_delay");
  CHECK(scans.uncertainty == Approx(2 * filtered.uncertainty).epsilon(0.4));
  CHECK(std::abs(scans.value - 1 * mm) < 3 * scans.uncertainty);
}

TEST_CASE("on a steady course an offset of truth could be a delay: that uncertainty is reported") {
  const Measured m = measured(flown(straight_on, 20), "lidar_to_arms_delay");
  CHECK(m.value == Approx(0).margin(1e-4));
  CHECK(m.uncertainty == Approx(1 * mm / 0.2).epsilon(0.1));  // 1 mm at 200 mm/s
  const Measured uncertain = measured(flown(straight_on, 20, {}, 10 * mm), "lidar_to_arms_delay");
  CHECK(uncertain.uncertainty == Approx(10 * mm / 0.2).epsilon(0.1));
  CHECK_THAT(uncertain.reason, Catch::Contains("needs motion of 9") && Catch::Contains("mm/s"));
}

TEST_CASE("truth that is wrong in proportion to the way gone does not pretend to be a delay") {
  Random random(4, "scale");
  const auto scaled = [&](double t, pose_estimate_t& estimate) {
    Pose pose = to_and_fro(t);
    pose.position.x() *= 1.002;
    pose.position.z() += 0.01 * pose.position.x();
    set_pose(pose, estimate);
    shift(estimate, random.normal_vector(0.1 * mm));
  };
  const Measured m = measured(flown(to_and_fro, 60, scaled), "estimate_delay");
  CHECK(std::abs(m.value) < 3 * m.uncertainty);
  CHECK(m.uncertainty < 0.2 * mm);
}

TEST_CASE("a delay needs motion, of whatever kind") {
  const Measured m = measured(flown(resting, 20), "lidar_to_arms_delay");
  CHECK(std::isnan(m.value));
  CHECK_THAT(m.reason, Catch::Contains("not observable") && Catch::Contains("rests"));
  const auto late = [](double t, pose_estimate_t& e) { set_pose(tumbling(t - 0.05), e); };
  CHECK(measured(flown(tumbling, 60, late), "estimate_delay").value == Approx(0.05).epsilon(1e-3));
}

TEST_CASE("an angular velocity with one sign wrong cannot hide") {
  const auto flipped = [](double, pose_estimate_t& e) { e.angular_velocity_rad_s[1] *= -1; };
  const RunRecord good = flown(tumbling, 20);
  const RunRecord bad = flown(tumbling, 20, flipped);
  CHECK(measured(good, "angular_velocity_y_gain").value == Approx(1));
  CHECK(measured(bad, "angular_velocity_y_gain").value == Approx(-1));
  CHECK(measured(bad, "angular_velocity_y_gain").uncertainty < 0.01);
  CHECK(measured(bad, "angular_velocity_y_error", Statistic::mean).value ==
        Approx(radians(-6.0)).epsilon(1e-3));
  CHECK(measured(bad, "angular_velocity_x_error", Statistic::peak).value == Approx(0).margin(1e-6));
  CHECK(std::isnan(measured(good, "angular_velocity_x_gain").value));
  CHECK(measured(good, "angular_velocity_error").value == Approx(0).margin(1e-4));
}

TEST_CASE("velocities are compared with truth of the same time, not of the time before") {
  const auto speeding_up = [](double t) {
    return Pose{Vector3d(0, 0, 5 - 0.05 * t * t), Quaterniond::Identity()};
  };
  const Measured m = measured(flown(speeding_up, 5), "velocity_z_error", Statistic::peak);
  CHECK(m.value < 1e-4);  // the time before: 3 mm/s
  // The acceleration counts as noise: 100 mm/s^2 over 50 ms, by the root of 12.
  CHECK(m.uncertainty == Approx(0.1 * 0.05 / std::sqrt(12.0)).epsilon(0.1));
  const Measured speed = measured(flown(speeding_up, 5), "relative_speed", Statistic::max);
  CHECK(speed.value == Approx(0.5).epsilon(0.02));
}

TEST_CASE("a mount that is off is measured where the target rests") {
  Random random(5, "mount");
  Vector6d off;
  off << 4 * mm, 0, 0, 0, 0, radians(0.5);
  const auto moved_away = [](double t) {
    return t < 10 ? resting(t) : Pose{Vector3d(0.2 * (t - 10), 0, 5), Quaterniond::Identity()};
  };
  const RunRecord record = flown(moved_away, 20, [&](double t, pose_estimate_t& estimate) {
    Vector6d noise;
    noise << random.normal_vector(0.5 * mm), random.normal_vector(radians(0.05));
    set_pose(perturbed(moved_away(t), Vector6d(off + noise)), estimate);
    if (t > 10) shift(estimate, Vector3d(1, 0, 0));  // what moves does not count
  });
  const Measured offset = measured(record, "mount_offset");
  CHECK(offset.samples == 20);
  CHECK(offset.value == Approx(4 * mm).margin(0.5 * mm));
  CHECK(offset.uncertainty == Approx(1 * mm).epsilon(0.1));  // truth's, which does not average out
  CHECK(measured(record, "mount_x").value == Approx(4 * mm).margin(0.5 * mm));
  CHECK(measured(record, "mount_turn").value == Approx(radians(0.5)).margin(radians(0.05)));
  CHECK(measured(record, "mount_turn_x").value == Approx(0).margin(radians(0.05)));
}

namespace {

/// Errors drawn from the estimate's and truth's covariance, while the estimate claims its own
/// times a factor.
RunRecord claiming(double factor) {
  Random random(7, "nees");
  return flown(resting, 500, [&random, factor](double t, pose_estimate_t& estimate) {
    Vector6d error;
    error << random.normal_vector(std::sqrt(9e-6 + 1e-6)),
        random.normal_vector(std::sqrt(4e-6 + 1e-6));
    set_pose(perturbed(resting(t), error), estimate);
    for (double& c : estimate.covariance) c *= factor;
  });
}

}  // namespace

TEST_CASE("consistency is judged by chi-square bounds") {
  // Of 1000 consistent estimates the mean is within 6 +- 0.21 in 95 % of the cases.
  CHECK(measured(claiming(1), "overconfidence").value == Approx(1 / 1.036).epsilon(0.04));
  CHECK(measured(claiming(1), "underconfidence").value == Approx(0.965).epsilon(0.04));
  CHECK(measured(claiming(0.25), "overconfidence").value > 2);
  CHECK(measured(claiming(4), "underconfidence").value > 2);
  const Measured m = measured(claiming(1), "overconfidence");
  CHECK(m.reason.find("chi-square bounds 5.7") != std::string::npos);
}

TEST_CASE("where truth is worse than the estimate, the NEES is uncertain") {
  const Measured good = measured(flown(resting, 20, {}, 0.1 * mm), "nees", Statistic::mean);
  const Measured bad = measured(flown(resting, 20, {}, 100 * mm), "nees", Statistic::mean);
  CHECK(good.uncertainty < 0.4);
  CHECK(bad.uncertainty > 1.5);
}

TEST_CASE("wrong estimates with status ok are counted, uncertain ones half") {
  int count = 0;
  const auto sometimes = [&count](double by) {
    return [&count, by](double, pose_estimate_t& estimate) {
      if (++count % 4 == 0) shift(estimate, Vector3d(by, 0, 0));
    };
  };
  CHECK(measured(flown(resting, 20, sometimes(1)), "silently_wrong").value == Approx(0.25));
  // A tenth of 3 m counts.
  CHECK(measured(flown(resting, 20, sometimes(0.25)), "silently_wrong").value == 0);
  const Measured uncertain = measured(flown(resting, 20, sometimes(0.301)), "silently_wrong");
  CHECK(uncertain.value == Approx(0.125));
  CHECK(uncertain.uncertainty == Approx(0.0625));
  // One that admits it is not silent.
  const auto honest = [&](double t, pose_estimate_t& estimate) {
    sometimes(1)(t, estimate);
    for (int i = 0; i < 3; ++i) estimate.covariance[7 * i] = 1;
  };
  CHECK(measured(flown(resting, 20, honest), "silently_wrong").value == 0);
}

TEST_CASE("the miss distance is that of the interface at closest approach") {
  const Target replica = load_target("radarsat2", 3);
  REQUIRE(replica.port() != nullptr);
  // Turned by 2 deg about y, the interface passes 30 mm below the sensor's axis, 0.4 m away at t
  // = 5.
  const Quaterniond turn = rotation_from_vector({0, radians(2.0), 0});
  const auto path = [&](double t) {
    const Vector3d interface(0, 30 * mm, 0.4 + 0.1 * std::abs(t - 5));
    return Pose{interface - turn * replica.port()->pose.position, turn};
  };
  RunRecord record = flown(path, 8);
  CHECK(measured(record, "contact_offset").reason == "the target has no such docking port");
  run_info_t info{};
  info.utime = made::start;
  info.target = "radarsat2";
  info.target_length_m = 3;
  record.add(info);
  const Measured offset = measured(record, "contact_offset");
  CHECK(offset.value == Approx(30 * mm).epsilon(1e-6));
  // 1 mm of position, and 1 mrad at the lever of the interface about z and x.
  CHECK(offset.uncertainty > 1 * mm);
  CHECK(offset.uncertainty < 2 * mm);
  CHECK(measured(record, "contact_angle").value == Approx(radians(2.0)).epsilon(1e-6));
  CHECK(measured(record, "contact_angle").uncertainty == Approx(1e-3).epsilon(0.01));
  CHECK(measured(record, "contact_range").value == Approx(std::hypot(0.4, 0.03)).epsilon(1e-3));
  CHECK(measured(record, "docking_offset", Statistic::min).value == Approx(30 * mm).epsilon(1e-6));
}

TEST_CASE(
    "what was achieved is compared with what was commanded a dead time before, the learned one") {
  RunRecord record = flown(straight_on, 8);
  for (double t = 0; t < 8; t += 0.1) {
    testbed_state_t state{};
    state.utime = made::start + utime_from_seconds(t);
    state.seq = state.utime;
    state.session = made::session;
    state.state = testbed_state_t::MOVING;
    const Pose pose = straight_on(t + 0.4);  // the arms are there 0.4 s later
    Vector3d::Map(state.commanded_position_m) = pose.position;
    state.commanded_q_wxyz[0] = 1;
    record.add(state);
  }
  CHECK(measured(record, "achieved_position_error").reason.find("configuration") !=
        std::string::npos);
  run_info_t info{};
  info.utime = made::start;
  attachment_t settings{};
  settings.name = "testbed.yaml";
  settings.content = "setpoints: {dead_time: 150 ms}";
  info.attachments = {settings};
  info.attachment_count = 1;
  record.add(info);
  CHECK(measured(record, "achieved_position_error").value == Approx(50 * mm).epsilon(1e-3));
  const auto add_event = [&](double t, const std::string& text) {
    event_t event{};
    event.utime = made::start + utime_from_seconds(t);
    event.seq = event.utime;
    event.session = made::session;
    event.code = "dead-time";
    event.text = "a dead time of " + text + " ms is reckoned with: so it is";
    record.add(event);
  };
  const auto publish = [&](double t, double latency_s) {
    setpoint_latency_t message{};
    message.utime = made::start + utime_from_seconds(t);
    message.session = made::session;
    message.latency_s = latency_s;
    record.add(message);
  };
  SECTION("as the testbed has measured it") {
    publish(9, 0.1);  // after all that is judged
    add_event(4, "500.0");
    publish(1, 0.39);
    CHECK(measured(record, "achieved_position_error").value == Approx(2 * mm).epsilon(1e-3));
    publish(3, 0.4);
    CHECK(measured(record, "achieved_position_error").value == Approx(0).margin(1e-6));
  }
  SECTION("as an event has it, in logs that are older than the message") {
    add_event(9, "100.0");
    add_event(1, "390.0");
    CHECK(measured(record, "achieved_position_error").value == Approx(2 * mm).epsilon(1e-3));
    add_event(3, "400.0");
    CHECK(measured(record, "achieved_position_error").value == Approx(0).margin(1e-6));
  }
}

TEST_CASE("a fault begins with the simulated cell's acknowledgement, whatever the events") {
  RunRecord record = flown(resting, 20);
  const auto acknowledge = [&record](double t, std::int64_t seq) {
    injection_state_t state{};
    state.utime = made::start + utime_from_seconds(t);
    state.accepted_seq = seq;
    record.add(state);
  };
  injection_t injection{};
  event_t stops{};
  stops.node = "testbed";
  stops.severity = event_t::WARNING;
  stops.utime = made::start + 5120 * millisecond;
  record.add(stops);
  CHECK(measured(record, "reaction_time").reason == "nothing was injected");
  injection.seq = 1;
  injection.action = injection_t::INJECT;
  record.add(injection);
  acknowledge(1, 0);
  CHECK(measured(record, "reaction_time").reason == "nothing was injected");
  acknowledge(6, 1);  // repeated
  acknowledge(5, 1);
  CHECK(measured(record, "reaction_time").value == Approx(0.12));
  injection.seq = 2;
  injection.action = injection_t::CLEAR;
  record.add(injection);
  acknowledge(7, 2);
  CHECK(measured(record, "reaction_time").value == Approx(0.12));
}

TEST_CASE("latency is what the estimator's node reports of each estimate") {
  RunRecord record = flown(resting, 20);
  CHECK(measured(record, "latency").reason.find("latency_us") != std::string::npos);
  for (int i = 0; i < 10; ++i) {
    estimator_diagnostics_t d{};
    d.utime = made::start + i * second;
    d.seq = i;
    d.names = {"dropped_invalid", "latency_us"};
    d.values = {7, 1000.0 * (20 + i)};
    d.value_count = 2;
    record.add(d);
    record.add(d);
  }
  CHECK(measured(record, "latency", Statistic::max).value == Approx(0.029));
  CHECK(measured(record, "latency", Statistic::mean).samples == 10);
  CHECK(measurement_named("latency")->shown(0.029) == Approx(29));
}

TEST_CASE("a length near zero is as uncertain as all axes together") {
  const Matrix3d covariance = Vector3d(1, 4, 4).asDiagonal();
  CHECK(length_of(Vector3d::Zero(), covariance).truth_sigma == Approx(3));
  CHECK(length_of(Vector3d(1000, 0, 0), covariance).truth_sigma == Approx(1).epsilon(1e-2));
  CHECK(length_of(Vector3d(0, 0, 1000), covariance).truth_sigma == Approx(2).epsilon(1e-2));
}

TEST_CASE("each statistic has the uncertainty of the values that it is made of") {
  const std::vector<double> values = {1, -5, 3, 2};
  const std::vector<double> sigmas = {0.1, 0.5, 0.3, 0.2};
  CHECK(uncertainty(Statistic::peak, values, sigmas) == 0.5);
  CHECK(uncertainty(Statistic::max, values, sigmas) == 0.3);
  CHECK(uncertainty(Statistic::min, values, sigmas) == 0.5);
  CHECK(uncertainty(Statistic::first, values, sigmas) == 0.1);
  CHECK(uncertainty(Statistic::final, values, sigmas) == 0.2);
  CHECK(uncertainty(Statistic::p50, values, sigmas) == Approx(0.25));
  CHECK(uncertainty(Statistic::mean, values, sigmas) == Approx(0.275));
  CHECK(uncertainty(Statistic::rms, values, sigmas) == Approx(std::sqrt(0.39 / 4)));
}

TEST_CASE("every measurement has a name of its own, a family and a description") {
  std::set<std::string> names;
  for (const Measurement& m : measurements()) {
    INFO(m.name);
    CHECK(names.insert(m.name).second);
    CHECK_FALSE(m.family.empty());
    CHECK_FALSE(m.description.empty());
    CHECK((m.series == nullptr) != (m.number == nullptr));
    CHECK(measurement_named(m.name) == &m);
  }
}

TEST_CASE("the documentation has the table of measurements as it is") {
  CHECK(read_file("docs/measurements.md").find(describe_measurements(true)) != std::string::npos);
}
