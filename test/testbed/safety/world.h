// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <berth/event_t.hpp>
#include <berth/injection_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/setpoint_latency_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/bus/node.h"
#include "common/bus/simulation.h"
#include "drivers/simulated/simulated_cell.h"
#include "testbed/motion/clearance.h"

namespace berth::drills {

/// The whole cell in the twin, with every node that a lab has and a commander that keeps its lease;
/// what happens to it is measured in the simulated world itself, which no node sees.
class World {
 public:
  struct Options {
    std::uint64_t seed = 1;
    bool estimator = false;  ///< with the LIDAR's driver and the estimator
    std::int64_t session = 77;
    std::filesystem::path config = "config";
    Utime start = 1735776000 * second;
  };
  struct Motion {
    Utime utime = 0;
    double speed[2] = {0, 0};          ///< of all joints of an arm together: replica, sensor; rad/s
    bool running[2] = {false, false};  ///< whether its controller follows set-points
  };

  explicit World(const Options& options);
  ~World();

  Utime now() const { return simulation.now(); }
  void run_for(double s) { simulation.run_for(utime_from_seconds(s)); }
  bool run_until(const std::function<bool()>& done, double limit_s) {
    return simulation.run_until(done, now() + utime_from_seconds(limit_s));
  }

  testbed_command2_t command(std::int8_t what, const std::string& commander = "drill");
  /// @return its seq.
  std::int64_t send(const testbed_command2_t& command);
  std::int64_t send(std::int8_t what) { return send(command(what)); }
  testbed_command2_t move_to(const Xyzwpr& goal, double speed);
  /// Takes the lease within a quarter of a second, and keeps it.
  void keep_lease() { keep_lease_ = true; }
  /// Takes the lease and goes to the goal; runs until the arms have come to speed.
  void begin_move(double speed = 0.1);
  /// Takes the lease, tracks the target and approaches it; runs until the arms have come to speed.
  void begin_approach(double speed = 0.05);

  /// The same motions, without waiting.
  void move(double speed = 0.1);
  void approach(double speed = 0.05);

  void inject(const std::string& device, const std::string& fault, double value = 0);
  void clear_faults();
  /// As a signal would.
  void stop(const std::string& node);
  void go_on(const std::string& node);
  void kill(const std::string& node);
  /// As an endless loop in the node's worker would; its loop goes on.
  void stop_work(const std::string& node);
  void go_on_with_work(const std::string& node);
  /// In the estimator's place: twice a second the truth, half a second ago, displaced by this much
  /// it.
  void estimate_falsely(const Vector3d& offset);
  /// The LIDAR's ranges grow at this rate, m/s; 0: they are right again.
  void drift_ranges(double rate);
  /// Any bytes on any channel, as a log player sends them.
  void replay(const std::string& channel, std::vector<std::uint8_t> bytes);

  /// Where the arms really are.
  Joints true_joints(ArmRole role) { return cell().controller(role).true_joints(now()); }
  /// T_sensor_model as it really was, in the last three seconds.
  Pose true_pose(Utime t) const;
  /// Least distance between bodies of different parties since the beginning, m.
  double min_clearance() const { return min_clearance_; }
  bool saw(const std::string& code) const;
  /// Whether the node reports FAULT.
  bool in_fault(const std::string& node) const { return faults_.contains(node); }
  SimulatedCell& cell() { return *cell_; }

  Simulation simulation;
  testbed_state_t state{};
  setpoint_latency_t latency{};
  std::map<ArmRole, arm_state_t> arms;
  std::optional<pose_estimate_t> estimate;
  std::vector<event_t> events;
  std::vector<Motion> motion;
  /// Largest distance between a reported joint and its command a dead time before, rad.
  double lag() const { return lag_; }
  double max_lag = 0;

 private:
  injection_t injection(std::int8_t action);
  struct Hosted {
    SimulatedLoop* loop = nullptr;
    SimulatedBus* bus = nullptr;
    std::unique_ptr<Node> node;
  };
  using Maker = std::function<std::unique_ptr<Node>(NodeSetup, Bus&, Loop&)>;

  void host(const std::string& name, const Maker& make);
  void look();
  void on_arm(ArmRole role, const arm_state_t& state);
  void track();
  void publish_false_estimate();

  Options options_;
  RunSetup run_;
  std::map<std::string, Hosted> hosted_;
  SimulatedCell* cell_ = nullptr;
  SimulatedBus* bus_ = nullptr;
  SimulatedLoop* loop_ = nullptr;
  std::unique_ptr<testbed::Clearance> clearance_;
  double min_clearance_ = 10;
  int looks_ = 0;
  std::map<ArmRole, std::deque<std::pair<Utime, Joints>>> commanded_;
  double lag_ = 0;
  std::optional<Vector3d> false_by_;
  std::deque<std::pair<Utime, Pose>> poses_;
  std::set<std::string> faults_;
  double range_rate_ = 0;
  bool keep_lease_ = false;
  std::int64_t seq_ = 0;
  std::int64_t injections_ = 0;
};

}  // namespace berth::drills
