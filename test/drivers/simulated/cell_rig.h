// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/simulation.h"
#include "drivers/arm/arm_node.h"
#include "drivers/facility/facility_node.h"
#include "drivers/simulated/simulated_cell.h"

namespace berth {

/// The simulated cell of a layout with its three Modbus drivers, in the twin.
struct Rig {
  explicit Rig(const std::string& layout, std::uint64_t seed = 1, const WorldSettings& world = {},
               const std::filesystem::path& out = {}, bool tracker = false) {
    run.config = "config";
    run.target = "radarsat2";
    run.layout = layout;
    run.seed = seed;
    run.session = 5;
    run.out = out;
    SimulatedCell::Setup setup = load_simulated_cell(run);
    setup.settings.world = world;
    setup.settings.tracker.write = tracker;
    cell = std::make_unique<SimulatedCell>(NodeSetup{"simulated-cell", 5, ""}, setup,
                                           simulation.make_bus(), simulation.make_loop());
    nominal = setup.cell;
    for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
      nodes.push_back(make_arm_node(NodeSetup{std::string("arm-driver-") + name_of(role), 5, ""},
                                    run, role, simulation.make_bus(), simulation.make_loop()));
      bus.subscribe<arm_state_t>(arm_state_channel(role), Queue::fifo(),
                                 [this, role](const arm_state_t& state) { arms[role] = state; });
    }
    nodes.push_back(make_facility_node(NodeSetup{"facility-driver", 5, ""}, run,
                                       simulation.make_bus(), simulation.make_loop()));
    simulation.record([this](Utime t, const std::string& channel, Bytes bytes) {
      if (!recording) return;
      log += std::to_string(t) + channel;
      log.append(bytes.begin(), bytes.end());
    });
    simulation.run_for(second);
  }

  void command(ArmRole role, std::int8_t action, const Joints& joints = {}) {
    arm_command_t message{};
    message.utime = simulation.now();
    message.utime_expires = message.utime + 100 * millisecond;
    message.seq = ++seq;
    message.session = 5;
    message.action = action;
    message.speed_limit = 1;
    std::copy(joints.begin(), joints.end(), message.joint);
    bus.publish(arm_command_channel(role), message);
  }

  /// Both arms turn their first joint (in `free`: go along x), in opposite directions.
  void move(double duration) {
    for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
      command(role, arm_command_t::START);
    }
    simulation.run_for(100 * millisecond);
    const Utime begin = simulation.now();
    for (int i = 0; i < static_cast<int>(60 * duration); ++i) {
      const double way = 0.05 * seconds(simulation.now() - begin);
      for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
        Joints joints = nominal.arm(role).home;
        joints[0] += role == ArmRole::replica ? way : -way;
        command(role, arm_command_t::STREAM, joints);
      }
      simulation.run_until(begin + utime_from_seconds((i + 1) / 60.0));
    }
  }

  Joints reported(ArmRole role) {
    Joints joints{};
    std::copy(std::begin(arms[role].reported_joint), std::end(arms[role].reported_joint),
              joints.begin());
    return joints;
  }

  RunSetup run;
  Simulation simulation;
  Bus& bus = simulation.make_bus();
  std::unique_ptr<SimulatedCell> cell;
  std::vector<std::unique_ptr<Node>> nodes;
  Cell nominal;
  std::map<ArmRole, arm_state_t> arms;
  bool recording = true;
  std::string log;
  std::int64_t seq = 0;
};

}  // namespace berth
