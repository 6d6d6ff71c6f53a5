// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <berth/event_t.hpp>
#include <berth/node_status_t.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/simulation.h"
#include "drivers/arm/arm_node.h"
#include "drivers/arm/snpx_adapter.h"
#include "drivers/simulated/simulated_controller.h"
#include "lcmtypes/channels.h"

namespace berth {

/// One arm driver and one simulated controller in the twin, with the testbed's side of the bus in
/// the test's hands.
struct ArmBench {
  explicit ArmBench(SimulatedController::Options options = default_options(), ArmErrors errors = {},
                    const std::string& arm_file = "config/arms/m710ic_50.yaml") {
    map = RegisterMap::load("config/registers/snpx.yaml");
    placed.role = ArmRole::replica;
    placed.kinematics = ArmKinematics::load(arm_file);
    placed.home = {0.1, 0.2, -0.3, 0.4, -0.5, 0.6};
    controller = std::make_unique<SimulatedController>("arm:502", map, placed, errors, options,
                                                       simulation.make_loop());
    Bus& test_bus = simulation.make_bus();
    bus = &test_bus;
    test_bus.subscribe<arm_state_t>(channels::arm_state_replica, Queue::fifo(),
                                    [this](const arm_state_t& s) { states.push_back(s); });
    test_bus.subscribe<event_t>(channels::event, Queue::fifo(),
                                [this](const event_t& e) { events.push_back(e); });
    test_bus.subscribe<node_status_t>(channels::node_status, Queue::fifo(),
                                      [this](const node_status_t& s) { status = s; });
  }

  static SimulatedController::Options default_options() {
    SimulatedController::Options options;
    options.rotary_quantum = radians(0.0001);
    options.linear_quantum = 1e-6;
    return options;
  }

  void start_driver(const std::string& address = "arm:502") {
    start_driver(address, placed.kinematics);
  }
  /// kinematics: that the driver assumes.
  void start_driver(const std::string& address, std::shared_ptr<const ArmKinematics> kinematics) {
    ArmNode::Setup setup;
    setup.role = ArmRole::replica;
    setup.device = load_devices("config").replica_arm;
    setup.device.address = address;
    setup.device.following_lag = following_lag;
    setup.kinematics = std::move(kinematics);
    SimulatedLoop& loop = simulation.make_loop();
    node = std::make_unique<ArmNode>(
        NodeSetup{"arm-driver-replica", session, ""}, setup,
        std::make_unique<SnpxAdapter>(setup.device, map, *setup.kinematics, loop),
        simulation.make_bus(), loop);
  }

  void send(std::int8_t action, const Joints& joints = {}) {
    arm_command_t command{};
    command.utime = simulation.now();
    command.seq = ++seq;
    command.session = session;
    command.utime_expires = simulation.now() + 100 * millisecond;
    command.action = action;
    std::copy(joints.begin(), joints.end(), command.joint);
    command.speed_limit = 1;
    bus->publish(channels::arm_command_replica, command);
  }

  /// Set-points along path(seconds since the call) at 60 Hz.
  void stream(double duration, const std::function<Joints(double)>& path) {
    const Utime begin = simulation.now();
    for (int i = 0; i < static_cast<int>(duration * 60); ++i) {
      send(arm_command_t::STREAM, path(seconds(simulation.now() - begin)));
      simulation.run_until(begin + utime_from_seconds((i + 1) / 60.0));
    }
  }

  void start_arm() {
    start_driver();
    simulation.run_for(500 * millisecond);
    send(arm_command_t::START);
    simulation.run_for(100 * millisecond);
  }

  const arm_state_t& last() const { return states.back(); }
  bool saw(const std::string& code) const {
    for (const event_t& event : events) {
      if (event.code == code) return true;
    }
    return false;
  }
  std::string text_of(const std::string& code) const {
    for (const event_t& event : events) {
      if (event.code == code) return event.text;
    }
    return "";
  }

  static constexpr std::int64_t session = 77;
  Simulation simulation;
  RegisterMap map;
  PlacedArm placed;
  double following_lag = 0;  // s, of the driver's device
  std::unique_ptr<SimulatedController> controller;
  Bus* bus = nullptr;
  std::unique_ptr<Node> node;
  std::vector<arm_state_t> states;
  std::vector<event_t> events;
  node_status_t status{};
  std::int64_t seq = 0;
};

}  // namespace berth
