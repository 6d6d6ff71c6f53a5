// SPDX-License-Identifier: BSD-3-Clause
#include "test/testbed/safety/world.h"

#include <algorithm>
#include <berth/estimator_command_t.hpp>
#include <berth/heartbeat_t.hpp>
#include <berth/node_status_t.hpp>
#include <cmath>
#include <stdexcept>

#include "drivers/arm/arm_node.h"
#include "drivers/facility/facility_node.h"
#include "drivers/lidar/lidar_node.h"
#include "estimator/node/estimator_node.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "testbed/node/testbed_node.h"

namespace berth::drills {
namespace {

constexpr Utime look_period = 4 * millisecond;
constexpr Utime speed_span = 8 * millisecond;
constexpr int clearance_every = 5;  // looks
constexpr Utime dead_time = 150 * millisecond;

Simulation::Options simulation_options(const World::Options& options) {
  Simulation::Options simulation;
  simulation.start = options.start;
  simulation.loss_seed = options.seed;
  return simulation;
}

/// Work takes some time, as config/twin.yaml has it.
Utime compute_delay(const std::string& name) {
  if (name == "estimator") return 30 * millisecond;
  return name == "simulated-cell" || name == "facility-driver" ? 0 : millisecond / 2;
}

/// Bytes as they are.
struct Raw {
  std::vector<std::uint8_t> bytes;
  int getEncodedSize() const { return static_cast<int>(bytes.size()); }
  int encode(void* buffer, int offset, int size) const {
    std::copy_n(bytes.begin(), size, static_cast<std::uint8_t*>(buffer) + offset);
    return size;
  }
};

}  // namespace

World::World(const Options& options) : simulation(simulation_options(options)), options_(options) {
  run_.config = options.config;
  run_.target = "radarsat2";
  run_.seed = options.seed;
  run_.session = options.session;
  host("simulated-cell", [&](NodeSetup setup, Bus& bus, Loop& loop) {
    // What is measured here are the nodes, not how the world departs from their files.
    SimulatedCell::Setup simulated = load_simulated_cell(run_);
    simulated.settings.world = load_world(run_.config, "exact");
    auto node = std::make_unique<SimulatedCell>(std::move(setup), std::move(simulated), bus, loop);
    cell_ = node.get();
    return node;
  });
  for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
    host(std::string("arm-driver-") + name_of(role), [&](NodeSetup setup, Bus& bus, Loop& loop) {
      return make_arm_node(std::move(setup), run_, role, bus, loop);
    });
  }
  host("facility-driver", [&](NodeSetup setup, Bus& bus, Loop& loop) {
    return make_facility_node(std::move(setup), run_, bus, loop);
  });
  host("testbed", [&](NodeSetup setup, Bus& bus, Loop& loop) {
    return make_testbed_node(std::move(setup), run_, bus, loop);
  });
  if (options.estimator) {
    host("lidar-driver", [&](NodeSetup setup, Bus& bus, Loop& loop) {
      return make_lidar_node(std::move(setup), run_, bus, loop);
    });
    host("estimator", [&](NodeSetup setup, Bus& bus, Loop& loop) {
      return make_estimator_node(std::move(setup), run_, bus, loop);
    });
  }
  clearance_ = std::make_unique<testbed::Clearance>(cell_->world(), testbed::Clearance::Limits{});

  bus_ = &simulation.make_bus();
  loop_ = &simulation.make_loop();
  bus_->subscribe<testbed_state_t>(channels::testbed_state, Queue::fifo(),
                                   [this](const testbed_state_t& m) {
                                     if (m.session == options_.session) state = m;
                                   });
  bus_->subscribe<setpoint_latency_t>(channels::setpoint_latency, Queue::fifo(),
                                      [this](const setpoint_latency_t& m) { latency = m; });
  bus_->subscribe<event_t>(channels::event, Queue::fifo(), [this](const event_t& m) {
    if (m.session == options_.session) events.push_back(m);
  });
  bus_->subscribe<node_status_t>(channels::node_status, Queue::fifo(),
                                 [this](const node_status_t& m) {
                                   if (m.session != options_.session) return;
                                   m.state == node_status_t::FAULT ? void(faults_.insert(m.node))
                                                                   : void(faults_.erase(m.node));
                                 });
  bus_->subscribe<pose_estimate_t>(channels::pose_estimate, Queue::fifo(),
                                   [this](const pose_estimate_t& m) { estimate = m; });
  for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
    bus_->subscribe<arm_state_t>(arm_state_channel(role), Queue::fifo(),
                                 [this, role](const arm_state_t& m) { on_arm(role, m); });
    bus_->subscribe<arm_command_t>(
        arm_command_channel(role), Queue::fifo(), [this, role](const arm_command_t& m) {
          auto& commanded = commanded_[role];
          if (m.action != arm_command_t::STREAM) return commanded.clear();
          Joints joints{};
          std::copy(std::begin(m.joint), std::end(m.joint), joints.begin());
          commanded.emplace_back(m.utime, joints);  // when it should be reached
          while (commanded.front().first < m.utime - second) commanded.pop_front();
        });
  }
  loop_->every(look_period, [this] { look(); });
  loop_->every(250 * millisecond, [this] {
    if (!keep_lease_) return;
    const bool holds = state.lease_holder == "drill";
    send(holds ? testbed_command2_t::KEEP_LEASE : testbed_command2_t::TAKE_LEASE);
  });
  run_for(2.0);
}

World::~World() = default;

void World::host(const std::string& name, const Maker& make) {
  Hosted hosted;
  hosted.loop = &simulation.make_loop();
  hosted.bus = &simulation.make_bus(compute_delay(name));
  hosted.node = make({name, options_.session, "", compute_delay(name)}, *hosted.bus, *hosted.loop);
  hosted_.emplace(name, std::move(hosted));
}

void World::look() {
  Motion now_moving;
  now_moving.utime = now();
  for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
    SimulatedController& controller = cell_->controller(role);
    const Joints here = controller.true_joints(now());
    const Joints before = controller.true_joints(now() - speed_span);
    double sum = 0;
    for (std::size_t i = 0; i < 6; ++i) sum += std::pow(here[i] - before[i], 2);
    const int arm = role == ArmRole::replica ? 0 : 1;
    now_moving.speed[arm] = std::sqrt(sum) / seconds(speed_span);
    now_moving.running[arm] = controller.state() == ControllerState::running;
  }
  motion.push_back(now_moving);
  poses_.emplace_back(now(), cell_->true_relative_pose(now()));
  while (poses_.front().first < now() - 3 * second) poses_.pop_front();
  cell_->lidar().faults().range_bias += range_rate_ * seconds(look_period);
  if (++looks_ % clearance_every != 0) return;
  const testbed::ArmPair arms_now{true_joints(ArmRole::replica), true_joints(ArmRole::sensor)};
  min_clearance_ = std::min(min_clearance_, clearance_->min_distance(arms_now, 1));
}

Pose World::true_pose(Utime t) const {
  const auto later = std::find_if(poses_.begin(), poses_.end(),
                                  [&](const auto& entry) { return entry.first >= t; });
  return later == poses_.end() ? poses_.back().second : later->second;
}

void World::on_arm(ArmRole role, const arm_state_t& message) {
  if (message.session != options_.session) return;
  arms[role] = message;
  if (message.valid == 0) return;
  const auto& commanded = commanded_[role];
  const auto after = std::find_if(commanded.begin(), commanded.end(),
                                  [&](const auto& entry) { return entry.first >= message.utime; });
  if (after == commanded.begin() || after == commanded.end()) return;
  const auto before = std::prev(after);
  const double s = static_cast<double>(message.utime - before->first) /
                   static_cast<double>(after->first - before->first);
  lag_ = 0;
  for (std::size_t i = 0; i < 6; ++i) {
    const double reference = before->second[i] + s * (after->second[i] - before->second[i]);
    lag_ = std::max(lag_, std::abs(message.reported_joint[i] - reference));
  }
  max_lag = std::max(max_lag, lag_);
}

testbed_command2_t World::command(std::int8_t what, const std::string& commander) {
  testbed_command2_t message{};
  message.utime = now();
  message.seq = ++seq_;
  message.session = options_.session;
  message.utime_expires = now() + 2 * second;
  message.commander = commander;
  message.command = what;
  message.q_wxyz[0] = 1;
  message.speed_override = 1;
  return message;
}

std::int64_t World::send(const testbed_command2_t& message) {
  bus_->publish(channels::testbed_command, message);
  return message.seq;
}

testbed_command2_t World::move_to(const Xyzwpr& goal, double speed) {
  testbed_command2_t message = command(testbed_command2_t::MOVE);
  set_pose(pose_from_xyzwpr(goal), message);
  message.speed_m_s = speed;
  message.angular_speed_rad_s = radians(10.0);
  return message;
}

void World::move(double speed) { send(move_to({200, -150, 4200, 5, 15, -10}, speed)); }

void World::approach(double speed) {
  testbed_command2_t message = command(testbed_command2_t::APPROACH);
  message.standoff_m = 3.2;
  message.speed_m_s = speed;
  send(message);
}

void World::begin_move(double speed) {
  send(testbed_command2_t::TAKE_LEASE);
  keep_lease_ = true;
  run_for(0.1);
  move(speed);
  run_for(4.0);
  if (state.state != testbed_state_t::MOVING) {
    throw std::runtime_error("the arms do not move: " + state.reason + state.refusal);
  }
}

void World::track() {
  estimator_command_t message{};
  message.utime = now();
  message.seq = ++seq_;
  message.session = options_.session;
  message.commander = "drill";
  message.command = estimator_command_t::TRACK;
  message.first_scan_id = 1;
  message.has_initial_pose = 1;
  const Pose pose = cell_->true_relative_pose(now());
  set_pose(pose, message.initial_position_m, message.initial_q_wxyz);
  bus_->publish(channels::estimator_command, message);
}

void World::begin_approach(double speed) {
  send(testbed_command2_t::TAKE_LEASE);
  keep_lease_ = true;
  run_for(0.1);
  const std::int64_t there = send(move_to({100, -100, 5500, 10, 8, -12}, 0.2));
  if (!run_until([&] { return state.finished_seq == there; }, 30)) {
    throw std::runtime_error("the arms do not come to the start: " + state.reason + state.refusal);
  }
  track();
  run_for(3.0);
  approach(speed);
  run_for(6.0);
  if (state.state != testbed_state_t::CLOSED_LOOP) {
    throw std::runtime_error("the approach does not go on: " + state.reason + state.refusal);
  }
}

injection_t World::injection(std::int8_t action) {
  injection_t message{};
  message.utime = now();
  message.utime_expires = now() + 2 * second;
  message.seq = ++injections_;
  message.session = options_.session;
  message.commander = "drill";
  message.action = action;
  return message;
}

void World::inject(const std::string& device, const std::string& fault, double value) {
  injection_t message = injection(injection_t::INJECT);
  message.device = device;
  message.fault = fault;
  message.value = value;
  bus_->publish(channels::injection, message);
}

void World::clear_faults() {
  bus_->publish(channels::injection, injection(injection_t::CLEAR_ALL));
}

void World::stop(const std::string& node) {
  simulation.stop(*hosted_.at(node).loop, *hosted_.at(node).bus);
}

void World::go_on(const std::string& node) {
  simulation.go_on(*hosted_.at(node).loop, *hosted_.at(node).bus);
}

void World::stop_work(const std::string& node) { simulation.stop_work(*hosted_.at(node).loop); }

void World::go_on_with_work(const std::string& node) {
  simulation.go_on_with_work(*hosted_.at(node).loop);
}

void World::kill(const std::string& node) {
  Hosted& hosted = hosted_.at(node);
  simulation.kill(*hosted.loop, *hosted.bus);
  hosted.node.reset();
}

void World::estimate_falsely(const Vector3d& offset) {
  if (!false_by_) {
    kill("estimator");
    loop_->every(50 * millisecond, [this] {
      heartbeat_t beat{};
      beat.session = options_.session;
      beat.node = "estimator";
      bus_->publish(channels::heartbeat, beat);
    });
    loop_->every(500 * millisecond, [this] { publish_false_estimate(); });
  }
  false_by_ = offset;
}

void World::publish_false_estimate() {
  Pose pose = true_pose(now() - 500 * millisecond);
  pose.position += *false_by_;
  pose_estimate_t message{};
  message.utime = now() - 500 * millisecond;
  message.session = options_.session;
  message.status = pose_estimate_t::OK;
  set_pose(pose, message);
  for (int i = 0; i < 6; ++i) message.covariance[7 * i] = 1e-6;
  bus_->publish(channels::pose_estimate, message);
}

void World::drift_ranges(double rate) {
  range_rate_ = rate;
  if (rate == 0) cell_->lidar().faults().range_bias = 0;
}

void World::replay(const std::string& channel, std::vector<std::uint8_t> bytes) {
  bus_->publish(channel, Raw{std::move(bytes)});
}

bool World::saw(const std::string& code) const {
  return std::any_of(events.begin(), events.end(),
                     [&](const event_t& e) { return e.code == code; });
}

}  // namespace berth::drills
