// SPDX-License-Identifier: BSD-3-Clause
#include "test/testbed/safety/drill.h"

#include <algorithm>

namespace berth::drills {
namespace {

constexpr double braking_limit = 0.3;        // s, from the first sign to arms that brake
constexpr double clearance_limit = 0.05;     // m, safety.min_clearance of config/testbed.yaml
constexpr double time_to_contradict = 10.0;  // s
constexpr double watched_for = 3.0;          // s after the first sign
constexpr double time_to_go_on = 8.0;        // s after it was put right
constexpr double still = 1e-4;               // rad/s

double since(Utime t, Utime reference) { return seconds(t - reference); }

/// s after the sign at which the arm has gone at nine tenths of its greatest speed since for the
/// last time.
double braking_time(const std::vector<World::Motion>& motion, Utime sign, int arm) {
  double max_speed = 0;
  for (const auto& m : motion) {
    if (m.utime >= sign) max_speed = std::max(max_speed, m.speed[arm]);
  }
  if (max_speed < still) return 0;
  Utime last = sign;
  for (const auto& m : motion) {
    if (m.utime >= sign && m.speed[arm] >= 0.9 * max_speed) last = m.utime;
  }
  return seconds(last - sign);
}

void measure(const World& world, Utime fault, Utime sign, Outcome& outcome) {
  const auto& motion = world.motion;
  for (const int arm : {0, 1}) {
    outcome.braking = std::max(outcome.braking, braking_time(motion, sign, arm));
  }
  for (const auto& m : motion) {
    if (m.utime < fault) continue;
    if (outcome.held < 0 && !m.running[0] && !m.running[1]) outcome.held = since(m.utime, sign);
    const bool stands = m.speed[0] < still && m.speed[1] < still;
    if (!stands) {
      outcome.at_rest = -1;
    } else if (outcome.at_rest < 0) {
      outcome.at_rest = since(m.utime, sign);
    }
  }
  for (const event_t& event : world.events) {
    if (event.utime < fault || event.severity < event_t::WARNING) continue;
    if (!outcome.code.empty() && event.node != "testbed") continue;
    outcome.seen = since(event.utime, sign);
    outcome.code = event.code;
    outcome.text = event.text;
    if (event.node == "testbed") break;
  }
  outcome.state = world.state.state;
}

bool goes_on(World& world, const Drill& drill) {
  drill.mend(world);
  world.run_for(1.0);
  if (drill.command) {
    world.send(*drill.command);
    world.run_for(0.5);
    if (*drill.command == testbed_command2_t::RESET) world.send(testbed_command2_t::RESUME);
  }
  const std::int8_t expected =
      drill.closed_loop ? testbed_state_t::CLOSED_LOOP : testbed_state_t::MOVING;
  const auto moves = [&] {
    const auto& now = world.motion.back();
    return world.state.state == expected && now.speed[0] > still && now.speed[1] > still;
  };
  // A command refused because the last scan began before the fault was removed is sent again.
  double left = time_to_go_on;
  for (; left > 4 && drill.command == testbed_command2_t::RESUME; left -= 2) {
    if (world.run_until(moves, 2)) return true;
    if (!world.state.refusal.empty()) world.send(testbed_command2_t::RESUME);
  }
  return world.run_until(moves, left);
}

}  // namespace

Outcome run(const Drill& drill, std::uint64_t seed, double instant) {
  World::Options options;
  options.seed = seed;
  options.estimator = drill.closed_loop;
  World world(options);
  if (drill.closed_loop) {
    world.begin_approach();
  } else {
    world.begin_move();
  }
  world.run_for(instant);

  const Utime fault = world.now();
  drill.begin(world);
  Utime sign = fault;
  Outcome outcome;
  if (drill.contradicts) {
    if (!world.run_until([&] { return drill.contradicts(world); }, time_to_contradict)) {
      outcome.failure = "nothing contradicts within " + std::to_string(time_to_contradict) + " s";
    }
    sign = world.now();
    outcome.first_sign = since(sign, fault);
  }
  world.run_for(watched_for);
  measure(world, fault, sign, outcome);
  if (drill.mend) {
    outcome.resumed = goes_on(world, drill);
    if (!outcome.resumed) {
      outcome.failure = "does not go on: " + world.state.reason + " " + world.state.refusal;
    }
  }
  outcome.min_clearance = world.min_clearance();
  return outcome;
}

std::string verdict(const Drill& drill, const Outcome& outcome) {
  if (!outcome.failure.empty()) return outcome.failure;
  if (std::find(drill.codes.begin(), drill.codes.end(), outcome.code) == drill.codes.end()) {
    return "the operator reads '" + outcome.code + "', not '" + drill.codes.front() + "'";
  }
  if (outcome.state != drill.state) {
    return "the testbed is in state " + std::to_string(outcome.state) + ", not " +
           std::to_string(drill.state);
  }
  if (outcome.at_rest < 0) return "the arms do not come to stand";
  if (!(outcome.braking <= braking_limit)) {
    return "braking begins after " + std::to_string(1e3 * outcome.braking) + " ms";
  }
  if (!(outcome.min_clearance >= clearance_limit)) {
    return "bodies come as near as " + std::to_string(1e3 * outcome.min_clearance) + " mm";
  }
  return "";
}

}  // namespace berth::drills
