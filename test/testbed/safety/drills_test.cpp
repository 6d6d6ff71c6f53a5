// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <fstream>
#include <regex>

#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/testbed/safety/drill.h"

namespace berth::drills {
namespace {

using Catch::Matchers::Contains;

TEST_CASE("every fault stops both arms in time and far enough apart, and they go on as promised") {
  for (const Drill& drill : drills()) {
    const Outcome outcome = run(drill, 1, 0.3);
    INFO(drill.name << ": " << outcome.code << ": " << outcome.text);
    CHECK(verdict(drill, outcome) == "");
  }
}

TEST_CASE("with a fifth of all packets lost the arms hold or go on, and nothing else happens") {
  World world({});
  world.begin_move();
  world.simulation.set_bus_loss(0.2);
  int holds = 0;
  bool held_before = false;
  for (int i = 0; i < 200; ++i) {
    world.run_for(0.1);
    const bool holds_now = world.state.state == testbed_state_t::HOLDING;
    holds += holds_now && !held_before ? 1 : 0;
    held_before = holds_now;
    INFO(world.state.reason);
    REQUIRE((holds_now || world.state.state == testbed_state_t::MOVING ||
             world.state.state == testbed_state_t::HELD ||
             world.state.state == testbed_state_t::IDLE));
    CHECK(world.lag() < radians(1.0));
  }
  CHECK(holds > 0);
  CHECK(world.min_clearance() > 0.1);
  world.simulation.set_bus_loss(0);
  world.run_for(1);
  if (world.state.state == testbed_state_t::HELD) world.send(testbed_command2_t::RESUME);
  CHECK(world.run_until([&] { return world.state.state == testbed_state_t::IDLE; }, 60));
}

TEST_CASE("of two commanders the second is refused, and may stop all the same") {
  World world({});
  world.begin_move();
  world.send(world.command(testbed_command2_t::TAKE_LEASE, "another"));
  world.run_for(0.1);
  CHECK_THAT(world.state.refusal, Contains("held by 'drill'"));
  testbed_command2_t other = world.move_to({0, 0, 5000, 0, 0, 0}, 0.1);
  other.commander = "another";
  world.send(other);
  world.run_for(0.2);
  CHECK(world.state.refused_seq == other.seq);
  CHECK(world.saw("command-refused"));
  CHECK(world.state.state == testbed_state_t::MOVING);
  CHECK(world.state.lease_holder == "drill");
  world.send(world.command(testbed_command2_t::HOLD, "another"));
  world.run_for(1.5);
  CHECK(world.state.state == testbed_state_t::HELD);
  CHECK_THAT(world.state.reason, Contains("another"));
  CHECK(world.motion.back().speed[0] < 1e-6);
}

TEST_CASE("yesterday's log, played into the live cell, moves nothing; its stops are stops") {
  struct Message {
    Utime after;
    std::string channel;
    std::vector<std::uint8_t> bytes;
  };
  std::vector<Message> log;
  {
    World::Options options;
    options.session = 76;
    options.start -= 24 * 3600 * second;
    World yesterday(options);
    const Utime begin = yesterday.now();
    yesterday.simulation.record([&](Utime t, const std::string& channel, Bytes bytes) {
      log.push_back({t - begin, channel, {bytes.begin(), bytes.end()}});
    });
    yesterday.begin_move();
    yesterday.inject("plc", "estop");
    yesterday.run_for(1);
  }
  REQUIRE(log.size() > 1000);
  World world({});
  const Joints before[2] = {world.true_joints(ArmRole::replica),
                            world.true_joints(ArmRole::sensor)};
  const auto play = [&] {
    const Utime begin = world.now();
    for (const Message& message : log) {
      world.simulation.run_until(begin + message.after);
      world.replay(message.channel, message.bytes);
    }
    world.run_for(1);
  };
  SECTION("while it stands") {
    play();
    CHECK(world.true_joints(ArmRole::replica) == before[0]);
    CHECK(world.true_joints(ArmRole::sensor) == before[1]);
    CHECK(world.saw("command-of-another-session"));
    CHECK(world.state.state == testbed_state_t::IDLE);
    CHECK(world.cell().plc().estop_closed());
  }
  SECTION("while it moves: it is held by name, and goes on when it is resumed") {
    world.begin_move();
    play();
    CHECK(world.saw("unusual-stop"));
    CHECK(world.state.state == testbed_state_t::HELD);
    CHECK(world.motion.back().speed[0] < 1e-6);
    world.send(testbed_command2_t::RESUME);
    CHECK(world.run_until([&] { return world.state.state == testbed_state_t::IDLE; }, 60));
    CHECK(distance(world.cell().true_relative_pose(world.now()),
                   pose_from_xyzwpr({200, -150, 4200, 5, 15, -10})) < 1e-3);
  }
}

TEST_CASE("arms that follow stay well within the lag that is allowed") {
  for (const double speed : {0.05, 0.2, 0.5}) {
    World world({});
    world.begin_move(speed);
    REQUIRE(world.run_until([&] { return world.state.state == testbed_state_t::IDLE; }, 60));
    CHECK(world.max_lag < radians(0.3));  // of 1 deg
  }
}

TEST_CASE("arms whose controllers have another dead time than the nominal one follow, too") {
  const TemporaryDirectory directory;
  World::Options options;
  options.config = directory.path() / "config";
  std::filesystem::copy("config", options.config, std::filesystem::copy_options::recursive);
  const std::string dead_time = GENERATE("dead_time: 20 ms", "dead_time: 400 ms");
  std::ofstream(options.config / "simulation.yaml") << std::regex_replace(
      read_file("config/simulation.yaml"), std::regex("dead_time: 150 ms"), dead_time);
  World world(options);
  world.keep_lease();
  world.run_for(0.5);
  world.move(0.5);
  REQUIRE(world.run_until([&] { return world.state.state == testbed_state_t::MOVING; }, 5));
  REQUIRE(world.run_until([&] { return world.state.state != testbed_state_t::MOVING; }, 60));
  INFO(world.state.reason);
  CHECK(world.state.state == testbed_state_t::IDLE);
  // by the nominal dead time it would have strayed
  if (dead_time == "dead_time: 400 ms") CHECK(world.max_lag > radians(1.0));
  REQUIRE(world.latency.seq > 0);
  CHECK(world.latency.latency_s ==
        Approx(dead_time == "dead_time: 400 ms" ? 0.4 : 0.02).margin(0.02));
  CHECK(world.latency.nominal_s == Approx(0.15));
  SECTION("and are stopped when they run away") {
    world.send(world.move_to({0, 0, 5000, 0, 0, 0}, 0.2));
    world.run_for(3);
    REQUIRE(world.state.state == testbed_state_t::MOVING);
    world.inject("arm-replica", "runaway", 0.3);
    const Utime begin = world.now();
    REQUIRE(world.run_until([&] { return world.saw("arm-strays"); }, 2));
    CHECK(world.now() - begin < 300 * millisecond);
  }
}

TEST_CASE("arms that would come too near stop before they are") {
  double wide = 0;
  double narrow = 0;
  {
    World world({});
    wide = world.min_clearance();
    world.begin_move(0.2);
    REQUIRE(world.run_until([&] { return world.state.state == testbed_state_t::IDLE; }, 60));
    narrow = world.min_clearance();
  }
  REQUIRE(narrow < wide - 0.003);
  const double limit = 0.5 * (narrow + wide);
  // A limit that this motion breaks, as if its path had been checked with another one.
  const TemporaryDirectory directory;
  World::Options options;
  options.config = directory.path() / "config";
  std::filesystem::copy("config", options.config, std::filesystem::copy_options::recursive);
  std::ofstream(options.config / "testbed.yaml")
      << std::regex_replace(read_file("config/testbed.yaml"), std::regex("min_clearance: 50 mm"),
                            "min_clearance: " + std::to_string(1e3 * limit) + " mm");
  World world(options);
  world.keep_lease();
  world.run_for(0.5);
  world.move(GENERATE(0.05, 0.2, 0.5));
  REQUIRE(world.run_until([&] { return world.saw("too-near"); }, 60));
  world.run_for(2);
  CHECK(world.state.state == testbed_state_t::HELD);
  CHECK_THAT(world.state.reason, Contains("come nearer than"));
  CHECK(world.motion.back().speed[0] < 1e-6);
  CHECK(world.min_clearance() > limit);
}

TEST_CASE("an approach does not begin by an estimate that truth contradicts") {
  World::Options options;
  options.estimator = true;
  World world(options);
  world.estimate_falsely({0.4, 0, 0});
  world.run_for(2);
  world.send(testbed_command2_t::TAKE_LEASE);
  world.run_for(0.1);
  world.approach();
  world.run_for(0.5);
  CHECK_THAT(world.state.refusal, Contains("away from ground truth"));
  CHECK(world.saw("estimate-wrong"));
  CHECK(world.state.state == testbed_state_t::IDLE);
}

}  // namespace
}  // namespace berth::drills
