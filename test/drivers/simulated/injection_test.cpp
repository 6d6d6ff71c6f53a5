// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/injection.h"

#include <berth/facility_state_t.hpp>
#include <berth/injection_state_t.hpp>
#include <berth/injection_t.hpp>
#include <cmath>

#include "lcmtypes/channels.h"
#include "test/catch.h"
#include "test/drivers/simulated/cell_rig.h"

using Catch::Matchers::Contains;

namespace berth {
namespace {

/// A rig whose simulated cell receives injections of faults over the bus.
struct FaultyRig : Rig {
  FaultyRig() : Rig("range") {
    bus.subscribe<injection_state_t>(channels::injection_state, Queue::fifo(),
                                     [this](const injection_state_t& s) { state = s; });
    bus.subscribe<facility_state_t>(channels::facility_state, Queue::fifo(),
                                    [this](const facility_state_t& s) { facility = s; });
  }

  injection_t injection(const std::string& device, const std::string& fault, double value = 0,
                        double duration = 0) {
    injection_t message{};
    message.utime = simulation.now();
    message.utime_expires = message.utime + 2 * second;
    message.seq = ++injections;
    message.session = 5;
    message.commander = "test";
    message.action = injection_t::INJECT;
    message.device = device;
    message.fault = fault;
    message.value = value;
    message.duration_s = duration;
    return message;
  }
  void send(const injection_t& message) {
    bus.publish(channels::injection, message);
    simulation.run_for(10 * millisecond);
  }
  void inject(const std::string& device, const std::string& fault, double value = 0,
              double duration = 0) {
    send(injection(device, fault, value, duration));
  }
  void clear(const std::string& device, const std::string& fault) {
    injection_t message = injection(device, fault);
    message.action = injection_t::CLEAR;
    send(message);
  }

  std::int64_t injections = 0;
  injection_state_t state{};
  facility_state_t facility{};
};

TEST_CASE("a fault lasts until it is cleared, or for its duration, and the state shows it") {
  FaultyRig rig;
  rig.inject("plc", "estop");
  CHECK(rig.state.accepted_seq == 1);
  CHECK(rig.state.active == std::vector<std::string>{"plc: estop"});
  rig.simulation.run_for(200 * millisecond);
  CHECK_FALSE(rig.facility.estop_chain_closed);
  CHECK(rig.arms[ArmRole::replica].state == arm_state_t::ESTOP);
  rig.clear("plc", "estop");
  CHECK(rig.state.active.empty());
  rig.simulation.run_for(200 * millisecond);
  CHECK(rig.facility.estop_chain_closed);

  rig.inject("plc", "fence", 0, 0.5);
  rig.simulation.run_for(300 * millisecond);
  CHECK_FALSE(rig.facility.fence_closed);
  rig.simulation.run_for(500 * millisecond);
  CHECK(rig.facility.fence_closed);
  CHECK(rig.state.active.empty());
  CHECK(rig.state.accepted_seq == 3);
}

TEST_CASE("an injection repeated changes nothing but is answered") {
  FaultyRig rig;
  const injection_t first = rig.injection("plc", "fence", 0, 0.2);
  rig.send(first);
  rig.simulation.run_for(500 * millisecond);
  REQUIRE(rig.state.active.empty());
  const std::int64_t answers = rig.state.seq;
  rig.send(first);
  CHECK(rig.state.seq == answers + 1);
  CHECK(rig.state.accepted_seq == 1);
  CHECK(rig.state.active.empty());  // and did not begin anew
}

TEST_CASE("an injection of another session, or too late, changes nothing") {
  FaultyRig rig;
  injection_t message = rig.injection("plc", "estop");
  message.session = 6;
  rig.send(message);
  message = rig.injection("plc", "estop");
  message.utime_expires = rig.simulation.now() - second;
  rig.send(message);
  rig.simulation.run_for(2 * second);
  CHECK(rig.state.accepted_seq == 0);
  CHECK(rig.state.active.empty());
  CHECK(rig.facility.estop_chain_closed);
}

TEST_CASE("unknown or out of bounds injections are refused, and the refusal lists the known ones") {
  FaultyRig rig;
  rig.inject("lidaar", "silent");
  CHECK(rig.state.refused_seq == 1);
  CHECK(rig.state.accepted_seq == 0);
  CHECK_THAT(rig.state.refusal, Contains("lidaar") && Contains("arm-replica") && Contains("plc"));
  rig.inject("lidar", "estop");
  CHECK(rig.state.refused_seq == 2);
  CHECK_THAT(rig.state.refusal, Contains("estop") && Contains("range_bias"));
  rig.inject("lidar", "dropout", 1.5);
  CHECK_THAT(rig.state.refusal, Contains("0 % to 100 %") && Contains("150 %"));
  rig.inject("lidar", "range_bias", std::nan(""));
  CHECK(rig.state.refused_seq == 4);
  rig.inject("lidar", "silent", 1);
  CHECK_THAT(rig.state.refusal, Contains("takes no value"));
  rig.inject("lidar", "silent", 0, -1);
  CHECK_THAT(rig.state.refusal, Contains("duration"));
  CHECK(rig.state.active.empty());
}

TEST_CASE("the faults of an arm") {
  FaultyRig rig;
  const auto& arm = rig.arms[ArmRole::sensor];
  SECTION("silent: its driver loses it, the other arm is spared") {
    rig.inject("arm-sensor", "silent", 0, 1);
    rig.simulation.run_for(700 * millisecond);
    CHECK(arm.state == arm_state_t::OFFLINE);
    CHECK(rig.arms[ArmRole::replica].state != arm_state_t::OFFLINE);
    rig.simulation.run_for(5 * second);
    CHECK(arm.state != arm_state_t::OFFLINE);
  }
  SECTION("dropped connection: over as soon as it has begun") {
    rig.inject("arm-sensor", "drop_connection", 0, 100);
    CHECK(rig.state.accepted_seq == 1);
    CHECK(rig.state.active.empty());
    rig.simulation.run_for(5 * second);
    CHECK(arm.state != arm_state_t::OFFLINE);
  }
  SECTION("report drift: the reports leave, the arm stays") {
    const Pose before = rig.cell->true_relative_pose(rig.simulation.now());
    const Joints reported = rig.reported(ArmRole::sensor);
    rig.inject("arm-sensor", "report_drift", 0.01, 1);
    rig.simulation.run_for(2 * second);
    CHECK(rig.reported(ArmRole::sensor)[0] - reported[0] == Approx(0.01).epsilon(0.05));
    CHECK(distance(before, rig.cell->true_relative_pose(rig.simulation.now())) == 0);
  }
  SECTION("creep: the arm leaves and reports it") {
    const Pose before = rig.cell->true_relative_pose(rig.simulation.now());
    rig.inject("arm-replica", "creep", 0.01, 1);
    rig.simulation.run_for(2 * second);
    const Pose after = rig.cell->true_relative_pose(rig.simulation.now());
    CHECK(distance(before, after) > 0.005);
    CHECK(distance(after, rig.nominal.relative_pose(rig.reported(ArmRole::replica),
                                                    rig.reported(ArmRole::sensor))) < 1e-4);
  }
  SECTION("creep: an emergency stop ends it") {
    rig.inject("arm-replica", "creep", 0.05);
    rig.inject("plc", "estop");
    rig.simulation.run_for(second);
    const Pose before = rig.cell->true_relative_pose(rig.simulation.now());
    rig.simulation.run_for(second);
    CHECK(distance(before, rig.cell->true_relative_pose(rig.simulation.now())) == 0);
  }
  SECTION("report jump: at once, and back") {
    const Joints reported = rig.reported(ArmRole::sensor);
    rig.inject("arm-sensor", "report_jump", 0.05, 1);
    rig.simulation.run_for(100 * millisecond);
    CHECK(rig.reported(ArmRole::sensor)[2] - reported[2] == Approx(0.05).margin(1e-4));
    rig.simulation.run_for(2 * second);
    CHECK(rig.reported(ArmRole::sensor)[2] == Approx(reported[2]).margin(1e-6));
  }
  SECTION("runaway: the arm leaves its set-points while it runs, and a hold stops it") {
    rig.move(0.5);
    rig.inject("arm-replica", "runaway", 0.1);
    const Joints commanded = rig.nominal.replica.home;
    for (int i = 0; i < 60; ++i) {
      rig.command(ArmRole::replica, arm_command_t::STREAM, commanded);
      rig.simulation.run_for(16 * millisecond);
    }
    CHECK(rig.reported(ArmRole::replica)[1] - commanded[1] > 0.05);
    rig.command(ArmRole::replica, arm_command_t::HOLD);
    rig.simulation.run_for(second);
    const Joints stopped = rig.reported(ArmRole::replica);
    rig.simulation.run_for(second);
    CHECK(rig.reported(ArmRole::replica) == stopped);
  }
}

TEST_CASE("clear of a device, and of all") {
  FaultyRig rig;
  rig.inject("lidar", "range_bias", 0.05);
  rig.inject("lidar", "blackout");
  rig.inject("target", "occlusion", 0.5);
  CHECK(rig.state.active == std::vector<std::string>{"lidar: blackout", "lidar: range_bias 50 mm",
                                                     "target: occlusion 50 %"});
  CHECK(rig.cell->lidar().faults().range_bias == 0.05);
  rig.clear("lidar", "");
  CHECK(rig.state.active == std::vector<std::string>{"target: occlusion 50 %"});
  CHECK(rig.cell->lidar().faults().range_bias == 0);
  CHECK_FALSE(rig.cell->lidar().faults().blackout);
  injection_t all = rig.injection("", "");
  all.action = injection_t::CLEAR_ALL;
  rig.send(all);
  CHECK(rig.state.accepted_seq == 5);
  CHECK(rig.state.active.empty());
}

}  // namespace
}  // namespace berth
