// SPDX-License-Identifier: BSD-3-Clause
#include <berth/lidar_state_t.hpp>
#include <cmath>
#include <optional>

#include "common/core/random.h"
#include "evaluation/latency/estimate_delay.h"
#include "evaluation/latency/latency_collector.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;
using made::mm;

namespace {

/// Of the target, model frame: it swings along it, and across it.
const Vector3d long_side = Vector3d::UnitY();

/// To and fro by half a metre at up to this speed, turning a little.
Pose swinging(double t, double speed) {
  const double amplitude = 0.25;
  const double phase = speed / amplitude * t;
  return {Vector3d(0.1, 0.3 * amplitude * std::sin(phase), 4.5 + amplitude * std::cos(phase)),
          rotation_from_vector({0, 0, 0.1 * std::sin(phase)})};
}

/// Estimates at 2 Hz of a world in which truth's clocks and mounts are off, with the noise that
/// their covariance states. The estimator assumes a velocity that is a little old, and holds what
/// it measures back towards what it expects by that: by the share `shrinkage`, or by `sliding`
/// along the target's long side alone.
RunRecord swung(double speed, double delay, std::uint64_t seed, double shrinkage = 0,
                double sliding = 0) {
  Random random(seed, "delays");
  RunRecord record;
  const Pose mount{random.normal_vector(1 * mm), rotation_from_vector(random.normal_vector(1e-3))};
  constexpr double duration = 40;
  for (double t = -0.5; t <= duration + 0.5; t += 0.008) {
    record.add(made::truth(made::start + utime_from_seconds(t), mount * swinging(t, speed)));
  }
  constexpr double step = 0.5;
  constexpr double lag = 0.1;
  std::optional<Pose> expected;
  for (double t = 0; t < duration; t += step) {
    const Utime utime = made::start + utime_from_seconds(t);
    Vector6d noise;
    noise << random.normal_vector(3 * mm), random.normal_vector(2e-3);
    const Pose there = swinging(t - delay, speed);
    Pose seen = perturbed(there, noise);
    if (expected) {
      Vector6d held = shrinkage * difference(seen, *expected);
      const Vector3d side = seen.rotation * long_side;
      held.head<3>() += sliding * side * side.dot(expected->position - seen.position);
      seen = perturbed(seen, held);
    }
    Velocity velocity = velocity_between(swinging(t - delay - lag, speed), there, lag);
    velocity.linear += random.normal_vector(5 * mm);
    expected = moved(seen, velocity, step);
    pose_estimate_t message = made::estimate(utime, seen);
    Vector3d::Map(message.linear_velocity_m_s) = velocity.linear;
    Vector3d::Map(message.angular_velocity_rad_s) = velocity.angular;
    record.add(message);
  }
  record.add(made::state({{"go", 0, duration}}));
  return record;
}

struct Covered {
  int inside = 0;
  double half_width = 0;  // mean
};

Covered coverage(double speed, double delay, int runs, double shrinkage = 0, double sliding = 0) {
  Covered covered;
  for (int seed = 0; seed < runs; ++seed) {
    const RunRecord record =
        swung(speed, delay, static_cast<std::uint64_t>(seed), shrinkage, sliding);
    const DelayFit fit =
        estimate_delay(Measurer(record, {}), *record.phase("go"), EstimatePose::measured).fit;
    covered.inside += std::abs(fit.delay - delay) <= fit.half_width ? 1 : 0;
    covered.half_width += fit.half_width / runs;
  }
  return covered;
}

template <class Message>
void take(LatencyCollector& collector, const char* channel, const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  logs::LogEvent event{};
  event.utime = message.utime;
  event.channel = channel;
  event.data = bytes;
  collector.take(event);
}

/// Joint 1 to and fro; the arm is there so much later than commanded.
void move_arm(LatencyCollector& collector, const char* command_channel, const char* state_channel,
              double delay, Random& random) {
  const auto joint = [](double t) { return 0.1 * std::sin(0.7 * t); };
  for (double t = 0; t < 30; t += 1.0 / 60) {
    arm_command_t command{};
    command.utime = made::start + utime_from_seconds(t);
    command.session = made::session;
    command.action = arm_command_t::STREAM;
    command.joint[0] = joint(t);
    take(collector, command_channel, command);
  }
  for (double t = 0.5; t < 29; t += 0.01) {
    arm_state_t state{};
    state.utime = made::start + utime_from_seconds(t);
    state.session = made::session;
    state.valid = true;
    state.state = arm_state_t::RUNNING;
    state.utime_sent = state.utime;
    state.utime_received = state.utime + 400;
    state.clock_offset_s = 3 + 2e-5 * t;
    state.clock_offset_sigma_s = 1e-4;
    state.reported_joint[0] = joint(t - delay) + 0.01 + random.normal(1e-5);
    std::fill(std::begin(state.reported_joint_sigma), std::end(state.reported_joint_sigma), 3e-5);
    take(collector, state_channel, state);
  }
}

const Latency& named(const std::vector<Latency>& list, const std::string& name) {
  for (const Latency& l : list) {
    if (l.name == name) return l;
  }
  throw std::runtime_error("no latency '" + name + "'");
}

}  // namespace

TEST_CASE("a delay's 95 % interval holds the delay in 95 % of the worlds, and narrows with speed") {
  constexpr int runs = 60;
  const Covered fast = coverage(0.2, 2e-3, runs);
  const Covered slow = coverage(0.05, -5e-3, runs);
  CHECK(fast.inside >= 52);  // 57 expected, 1 % below 52
  CHECK(slow.inside >= 52);
  CHECK(fast.half_width < 8e-3);
  CHECK(slow.half_width > 2 * fast.half_width);
  CHECK(slow.half_width < 40e-3);
}

TEST_CASE("poses held back towards what was expected are not taken for late ones") {
  const Covered held_back = coverage(0.2, 2e-3, 60, 0.3);
  CHECK(held_back.inside >= 50);  // 93 % of many worlds; 1 % below 50
  CHECK(held_back.half_width < 10e-3);
  const Covered slipping = coverage(0.2, 2e-3, 60, 0, 0.7);
  CHECK(slipping.inside >= 52);
  CHECK(slipping.half_width < 8e-3);
}

TEST_CASE("estimates that steered the arms give no delay") {
  RunRecord record = swung(0.2, 2e-3, 1);
  testbed_state_t state{};
  state.utime = made::start - second;
  state.session = made::session;
  state.state = testbed_state_t::CLOSED_LOOP;
  record.add(state);
  const EstimateDelay none =
      estimate_delay(Measurer(record, {}), *record.phase("go"), EstimatePose::filtered);
  CHECK(none.fit.samples == 0);
  CHECK_THAT(none.not_observable, Catch::Contains("not steered"));
  state.utime = made::start + 10 * second;
  state.state = testbed_state_t::MOVING;
  record.add(state);
  const EstimateDelay later =
      estimate_delay(Measurer(record, {}), *record.phase("go"), EstimatePose::filtered);
  CHECK(later.fit.samples == 60);
}

TEST_CASE("how far the arms are behind their set-points, and each other, comes from a log") {
  Random random(1, "arms");
  LatencyCollector collector;
  move_arm(collector, channels::arm_command_replica, channels::arm_state_replica, 5e-3, random);
  move_arm(collector, channels::arm_command_sensor, channels::arm_state_sensor, -12e-3, random);
  RunRecord record;
  run_info_t info{};
  info.session = made::session;
  record.add(info);
  const auto list = collector.latencies(Measurer(record, {}));
  const auto check = [&](const char* name, double delay) {
    const Latency& l = named(list, name);
    INFO(name);
    CHECK(l.value == Approx(delay).margin(3e-4));
    constexpr double chord = 2e-5;  // set-points are joined by straight lines
    CHECK(l.low < delay + chord);
    CHECK(l.high > delay - chord);
    CHECK(l.high - l.low < 2e-3);
  };
  check("replica arm behind its set-points", 5e-3);
  check("sensor arm behind its set-points", -12e-3);
  check("sensor arm behind replica arm", -17e-3);
  CHECK(named(list, "replica arm, status read").value == Approx(400e-6));
  const Latency& clock = named(list, "sensor controller's clock minus host's");
  CHECK(clock.kind == Latency::Kind::clock);
  CHECK(clock.value == Approx(3 + 2e-5 * 29).margin(1e-6));
  CHECK(clock.remark == "drift 20.0 ppm");
}

TEST_CASE("arms at rest give no delay") {
  LatencyCollector collector;
  arm_command_t command{};
  arm_state_t state{};
  command.session = state.session = made::session;
  command.action = arm_command_t::STREAM;
  state.state = arm_state_t::RUNNING;
  state.valid = true;
  for (int i = 0; i < 100; ++i) {
    command.utime = state.utime = made::start + i * 16 * millisecond;
    take(collector, channels::arm_command_replica, command);
    take(collector, channels::arm_state_replica, state);
  }
  RunRecord record;
  run_info_t info{};
  info.session = made::session;
  record.add(info);
  const auto list = collector.latencies(Measurer(record, {}));
  const Latency& l = named(list, "replica arm behind its set-points");
  CHECK(std::isnan(l.value));
  CHECK_THAT(l.remark, Catch::Contains("not observable"));
}

TEST_CASE("what comes after a run was judged is not in its verdict") {
  RunRecord record = swung(0.05, 0, 1);
  const verdict_basis_t judged = record.basis();
  const std::size_t before = record.estimates().size();
  // late: true within the phase, received after the verdict
  auto late = made::estimate(made::start + 39700 * millisecond, swinging(39.7, 0.05));
  late.seq = judged.estimate_seq + 1;
  record.add(late);
  record.add(made::truth(judged.truth_utime + 8000, swinging(41, 0.05)));
  CHECK(record.estimates().size() == before + 1);
  record.keep_judged();  // no record of a judgement
  CHECK(record.estimates().size() == before + 1);
  SECTION("by the log") { record.add(judged); }
  SECTION("by an event, in logs that are older than VERDICT_BASIS") {
    event_t event{};
    event.code = judged_event_code;
    event.text = "on nothing";
    record.add(event);
    record.keep_judged();
    CHECK(record.estimates().size() == before + 1);
    event.seq = 1;
    event.text = "on estimates up to seq " + std::to_string(judged.estimate_seq) +
                 ", diagnostics up to seq " + std::to_string(judged.diagnostics_seq) +
                 ", truth up to utime " + std::to_string(judged.truth_utime);
    record.add(event);
  }
  record.keep_judged();
  CHECK(record.estimates().size() == before);
  CHECK(record.truth().samples().back().utime == judged.truth_utime);
}
