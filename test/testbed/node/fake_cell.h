// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <berth/event_t.hpp>
#include <berth/facility_state_t.hpp>
#include <berth/ground_truth_t.hpp>
#include <berth/node_status_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/bus/node.h"
#include "common/bus/simulation.h"
#include "common/core/random.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "testbed/node/testbed_node.h"

namespace berth {

inline constexpr std::int64_t test_session = 77;

/// An ideal arm and its driver: takes set-points between START and HOLD, is where it was commanded
/// to be a dead time later.
class FakeArm final : public Node {
 public:
  FakeArm(ArmRole role, const Joints& joints, Bus& bus, Loop& loop)
      : Node({std::string("arm-driver-") + name_of(role), test_session, ""}, bus, loop),
        role_(role),
        joints_(joints) {
    bus.subscribe<arm_command_t>(
        role == ArmRole::replica ? channels::arm_command_replica : channels::arm_command_sensor,
        Queue::fifo(), [this](const arm_command_t& c) { on(c); });
    loop.every(10 * millisecond, [this] { publish_state(); });
  }

  Joints joints() {
    const Utime t = now() - 150 * millisecond;
    while (!pending_.empty() && pending_.front().first <= t) {
      if (running_) joints_ = pending_.front().second;
      pending_.pop_front();
    }
    return joints_;
  }

  std::int8_t state = arm_state_t::IDLE;
  bool silent = false;
  bool valid = true;
  bool stuck = false;
  bool unresponsive = false;  ///< receives no command
  Utime controller_time = 0;
  double jump = 0;      ///< rad, error of its reported joints
  double override = 1;  ///< that its controller reports
  int holds = 0;
  int starts = 0;
  int setpoints = 0;
  double fastest = 0;  ///< rad/s or m/s of any joint, between set-points
  Utime last_hold = 0;

 private:
  void on(const arm_command_t& command) {
    const bool stops = command.action == arm_command_t::HOLD;
    if (unresponsive || command.session != test_session) return;
    if (now() > command.utime_expires && !stops) return;
    switch (command.action) {
      case arm_command_t::START:
        ++starts;
        if (state == arm_state_t::FAULT || state == arm_state_t::ESTOP) return;
        loop().after(200 * millisecond, [this] {
          state = arm_state_t::RUNNING;
          running_ = true;
        });
        break;
      case arm_command_t::HOLD:
        ++holds;
        last_hold = now();
        joints();
        pending_.clear();
        running_ = false;
        if (state == arm_state_t::RUNNING) state = arm_state_t::HELD;
        break;
      case arm_command_t::RESET:
        if (state == arm_state_t::FAULT) state = arm_state_t::HELD;
        break;
      default: {
        if (!running_ || stuck) return;
        ++setpoints;
        Joints target{};
        std::copy(std::begin(command.joint), std::end(command.joint), target.begin());
        if (!pending_.empty()) {
          const double dt = seconds(now() - pending_.back().first);
          for (std::size_t i = 0; i < 6 && dt > 0; ++i) {
            fastest = std::max(fastest, std::abs(target[i] - pending_.back().second[i]) / dt);
          }
        }
        pending_.emplace_back(now(), target);
      }
    }
  }

  void publish_state() {
    if (silent) return;
    arm_state_t message{};
    message.speed_override = override;
    message.utime = now();
    message.seq = ++seq_;
    message.session = test_session;
    message.valid = valid ? 1 : 0;
    message.state = state;
    const Joints q = joints();
    std::copy(q.begin(), q.end(), message.reported_joint);
    for (double& joint : message.reported_joint) joint += jump;
    message.controller_time_us = controller_time;
    std::fill(std::begin(message.reported_joint_sigma), std::end(message.reported_joint_sigma),
              3.5e-5);
    bus().publish(
        role_ == ArmRole::replica ? channels::arm_state_replica : channels::arm_state_sensor,
        message);
  }

  ArmRole role_;
  Joints joints_;
  bool running_ = false;
  std::deque<std::pair<Utime, Joints>> pending_;
  std::int64_t seq_ = 0;
};

class FakeFacility final : public Node {
 public:
  FakeFacility(Bus& bus, Loop& loop) : Node({"facility-driver", test_session, ""}, bus, loop) {
    timer_ = loop.every(100 * millisecond, [this] { publish_now(); });
  }
  ~FakeFacility() override { loop().cancel(timer_); }
  void publish_now() {
    facility_state_t message{};
    message.utime = now();
    message.session = test_session;
    message.valid = 1;
    message.estop_chain_closed = estop_closed ? 1 : 0;
    message.fence_closed = fence_closed ? 1 : 0;
    message.motion_enabled = 1;
    bus().publish(channels::facility_state, message);
  }
  bool estop_closed = true;
  bool fence_closed = true;

 private:
  Loop::TimerId timer_;
};

/// Reports once a second where the replica is, half a second ago, with the error set by the test.
class FakeEstimator final : public Node {
 public:
  FakeEstimator(const Cell& cell, FakeArm& replica, FakeArm& sensor, Bus& bus, Loop& loop)
      : Node({"estimator", test_session, ""}, bus, loop),
        cell_(cell),
        replica_(replica),
        sensor_(sensor),
        random_(5, "fake estimator") {
    loop.every(50 * millisecond, [this] {
      const Pose pose = cell_.relative_pose(replica_.joints(), sensor_.joints());
      past_.emplace_back(now(), pose);
      while (past_.size() > 11) past_.pop_front();
    });
    loop.every(second, [this] { publish_now(); });
  }

  bool silent = true;
  std::int8_t status = pose_estimate_t::OK;
  Vector6d offset = Vector6d::Zero();
  double noise = 0.002;
  double velocity_noise = 0.002;
  double variance = 4e-6;  // m^2 and rad^2, claimed

 private:
  void publish_now() {
    if (silent || past_.size() < 2) return;
    Vector6d error = offset;
    error.head<3>() += random_.normal_vector(noise);
    error.tail<3>() += random_.normal_vector(0.3 * noise);
    const Pose pose = perturbed(past_.front().second, error);
    pose_estimate_t message{};
    message.utime = past_.front().first;
    message.seq = ++seq_;
    message.session = test_session;
    message.status = status;
    set_pose(pose, message);
    for (int i = 0; i < 6; ++i) message.covariance[7 * i] = variance;
    const Velocity velocity = velocity_between(past_[0].second, past_[1].second,
                                               seconds(past_[1].first - past_[0].first));
    Vector3d::Map(message.linear_velocity_m_s) =
        velocity.linear + random_.normal_vector(velocity_noise);
    Vector3d::Map(message.angular_velocity_rad_s) =
        velocity.angular + random_.normal_vector(0.3 * velocity_noise);
    for (int i = 0; i < 6; ++i) {
      message.velocity_covariance[7 * i] = velocity_noise * velocity_noise;
    }
    bus().publish(channels::pose_estimate, message);
  }

  const Cell& cell_;
  FakeArm& replica_;
  FakeArm& sensor_;
  Random random_;
  std::deque<std::pair<Utime, Pose>> past_;
  std::int64_t seq_ = 0;
};

/// A heartbeat.
class FakeLidar final : public Node {
 public:
  using Node::Node;
};

/// The testbed node with ideal partners on the twin's bus, and a commander that keeps its lease.
class FakeCell {
 public:
  explicit FakeCell(const std::string& layout = "range",
                    const std::filesystem::path& config = "config")
      : cell(load_cell("config/layouts/" + layout + ".yaml", load_target("radarsat2", 0))) {
    replica = make<FakeArm>(ArmRole::replica, cell.replica.home);
    sensor = make<FakeArm>(ArmRole::sensor, cell.sensor.home);
    facility = make<FakeFacility>();
    {
      SimulatedLoop& loop = simulation.make_loop();
      estimator =
          std::make_unique<FakeEstimator>(cell, *replica, *sensor, simulation.make_bus(), loop);
    }
    SimulatedLoop& loop = simulation.make_loop();
    lidar = std::make_unique<FakeLidar>(NodeSetup{"lidar-driver", test_session, ""},
                                        simulation.make_bus(), loop);
    RunSetup run;
    run.config = config;
    run.target = "radarsat2";
    run.layout = layout;
    run.session = test_session;
    node_loop = &simulation.make_loop();
    node = make_testbed_node({"testbed", test_session, ""}, run, simulation.make_bus(), *node_loop);

    own_loop_ = &simulation.make_loop();
    own_bus_ = &simulation.make_bus();
    own_bus_->subscribe<testbed_state_t>(channels::testbed_state, Queue::fifo(),
                                         [this](const testbed_state_t& m) { state = m; });
    own_bus_->subscribe<ground_truth_t>(channels::ground_truth, Queue::fifo(),
                                        [this](const ground_truth_t& m) { truths.push_back(m); });
    own_bus_->subscribe<node_status_t>(channels::node_status, Queue::fifo(),
                                       [this](const node_status_t& m) {
                                         if (m.node == "testbed") status = m;
                                       });
    own_bus_->subscribe<event_t>(channels::event, Queue::fifo(),
                                 [this](const event_t& m) { ++events[m.code]; });
    own_loop_->every(500 * millisecond, [this] {
      if (keep_lease) send(testbed_command2_t::KEEP_LEASE);
    });
    run_for(1.0);
  }

  void run_for(double s) { simulation.run_for(utime_from_seconds(s)); }
  bool run_until(const std::function<bool()>& done, double limit_s) {
    return simulation.run_until(done, simulation.now() + utime_from_seconds(limit_s));
  }

  testbed_command2_t command(std::int8_t what) {
    testbed_command2_t message{};
    message.utime = simulation.now();
    message.seq = ++seq_;
    message.session = test_session;
    message.utime_expires = simulation.now() + 2 * second;
    message.commander = "test";
    message.command = what;
    message.q_wxyz[0] = 1;
    message.speed_override = speed_override;
    return message;
  }
  std::int64_t send(const testbed_command2_t& message) {
    own_bus_->publish(channels::testbed_command, message);
    return message.seq;
  }
  std::int64_t send(std::int8_t what) { return send(command(what)); }
  testbed_command2_t move_to(const Xyzwpr& goal, double speed = 0.1) {
    testbed_command2_t message = command(testbed_command2_t::MOVE);
    set_pose(pose_from_xyzwpr(goal), message);
    message.speed_m_s = speed;
    message.angular_speed_rad_s = radians(10.0);
    return message;
  }
  void take_lease() {
    send(testbed_command2_t::TAKE_LEASE);
    run_for(0.1);
    keep_lease = true;
  }
  bool finished(std::int64_t seq, double limit_s) {
    return run_until([&] { return state.finished_seq == seq; }, limit_s);
  }
  Pose relative() { return cell.relative_pose(replica->joints(), sensor->joints()); }
  double surface_distance() {
    const Vector3d eye = relative().inverse().position;
    return (RayCaster(cell.target.mesh).nearest(eye) - eye).norm();
  }
  Utime now() const { return simulation.now(); }

  Simulation simulation;
  Cell cell;
  std::unique_ptr<FakeArm> replica;
  std::unique_ptr<FakeArm> sensor;
  std::unique_ptr<FakeFacility> facility;
  std::unique_ptr<FakeEstimator> estimator;
  std::unique_ptr<FakeLidar> lidar;
  SimulatedLoop* node_loop = nullptr;  ///< the testbed's
  std::unique_ptr<Node> node;
  testbed_state_t state{};
  node_status_t status{};  ///< the testbed's
  std::vector<ground_truth_t> truths;
  std::map<std::string, int> events;
  bool keep_lease = false;
  double speed_override = 1;  ///< of every command

 private:
  template <class T, class... Arguments>
  std::unique_ptr<T> make(Arguments&&... arguments) {
    SimulatedLoop& loop = simulation.make_loop();
    return std::make_unique<T>(std::forward<Arguments>(arguments)..., simulation.make_bus(), loop);
  }

  SimulatedLoop* own_loop_ = nullptr;
  SimulatedBus* own_bus_ = nullptr;
  std::int64_t seq_ = 0;
};

}  // namespace berth
