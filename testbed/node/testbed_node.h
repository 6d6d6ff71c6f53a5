// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <berth/facility_state_t.hpp>
#include <berth/guidance_setpoint_t.hpp>
#include <berth/heartbeat_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/setpoint_latency_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <map>
#include <memory>
#include <optional>

#include "common/bus/commands.h"
#include "common/bus/node.h"
#include "common/core/cell.h"
#include "common/core/lease.h"
#include "common/core/run_setup.h"
#include "testbed/calibration/calibration.h"
#include "testbed/motion/command_history.h"
#include "testbed/motion/trajectory_history.h"
#include "testbed/node/chaser_motion.h"
#include "testbed/node/command_planner.h"
#include "testbed/safety/arm_watch.h"

namespace berth {

/// The testbed controller: the only commander of the arms. It turns TESTBED_COMMANDs into
/// set-points for both (ARM_COMMAND_*, streamed at the set-point rate from START to HOLD),
/// publishes GROUND_TRUTH and TESTBED_STATE, and stops the cell on the supervisor's verdict.
///
/// How it stops:
/// - HOLD, a lapsed lease, a stale or lost estimate: both arms come to rest on the path. The last
///   goes on by itself (HOLDING), the first two wait for RESUME (HELD).
/// - Silent partners: ARM_COMMAND HOLD at once. When none is silent the arms are started anew,
///   brought back to the path and go on by themselves (HOLDING).
/// - E-stop, fence, a controller that faults, stops, restarts or does not follow, impossible
///   reports, an estimate that contradicts ground truth, arms too near to each other: ARM_COMMAND
///   HOLD at once. RESUME starts the arms again, brings them back to the path and goes on.
/// HOLD and STOP are obeyed from any commander, of any session, however late, in any order, once
/// each; everything else only from the lease holder of this session, whose KEEP_LEASE may also
/// change the speed override of the motion under way. A motion is planned on the node's worker
/// while the arms are at rest; the command is answered then. A HOLD meanwhile holds the motion at
/// its start, a STOP abandons it.
class TestbedNode final : public Node {
 public:
  TestbedNode(NodeSetup setup, testbed::CalibratedCell cell, testbed::Settings settings, Bus& bus,
              Loop& loop);
  ~TestbedNode() override;

 private:
  using Verdict = testbed::SafetySupervisor::Verdict;
  using Level = testbed::SafetySupervisor::Level;

  /// rad or m: how far a joint of an arm at rest may yet settle.
  static constexpr double rest_angle = 5e-3;

  enum class Mode { idle, starting, moving, closed_loop };

  /// A task under way, from its acceptance to its end.
  struct Task {
    std::int64_t seq = 0;
    Mode mode = Mode::idle;                            // moving or closed_loop
    std::shared_ptr<const testbed::ArmMotion> motion;  // moving
    double time = 0;                                   // along the motion, or of flight
    bool retreat = false;
    bool done = false;                                         // closed_loop: only comes to rest
    std::shared_ptr<const testbed::ArmAllocation> allocation;  // closed_loop
    std::shared_ptr<testbed::Steering> steering;  // closed_loop by other than guidance_
    testbed::TargetMotion target_motion;          // closed_loop
    bool given_up = false;  // closed_loop: guidance retreats, and the event was published
  };

  /// A command whose motion is being planned.
  struct Planning {
    testbed_command2_t command{};
    testbed::ArmPair start;
    std::string hold_reason;  // of a HOLD meanwhile
  };
  /// The result of planning, from the worker.
  struct Planned {
    std::string refusal;  // empty: none
    Task task;
    std::optional<testbed::Guidance> guidance;  // begun, where that steers
    std::int64_t utime_estimate = 0;            // of the newest estimate used in planning
  };

  // messages
  void on_arm_state(ArmRole role, const arm_state_t& state);
  void on_facility(const facility_state_t& state);
  void on_estimate(const pose_estimate_t& message);
  void on_setpoint(const guidance_setpoint_t& setpoint);
  void on_command(const testbed_command2_t& command);
  bool on_lease_command(const testbed_command2_t& command);

  // commands
  void on_stop(const testbed_command2_t& command);
  void begin(const testbed_command2_t& command);
  std::string begin_motion(const testbed_command2_t& command);
  std::string retreat(const testbed_command2_t& command);
  std::string plan(const testbed_command2_t& command, const testbed::ArmPair& start,
                   std::function<void(Planned&)> job);
  void begin_planned(const Planning& planning, Planned planned);
  std::string refusal_after_planning(const Planning& planning, const Task& task) const;
  void abandon_planning(const std::string& reason);
  void reset(const std::string& reason);
  std::string resume(const testbed_command2_t& command);
  void set_override(double override);
  void on_controller_override(ArmRole role, double reported);
  /// Rate of time along a path: the commander's override, at most that of either controller, lest
  /// its joints fall behind.
  double rate() const;
  void start_task(Task task, const testbed::ArmPair& start);
  void accept(const testbed_command2_t& command);
  void refuse(const testbed_command2_t& command, const std::string& reason);

  // motion
  void tick();
  void run_start(double dt);
  void run_motion(double dt, bool wait);
  void run_closed_loop(double dt);
  bool retreats() const;  // guidance has given the approach up
  void end_retreat_within_reach(const Pose& reference, const Velocity& velocity, double progress,
                                const testbed::ArmPair& joints);
  void follow_guidance(testbed::Steering::Phase phase, const std::string& reason);
  void end_task(bool finished);
  void begin_start();
  void stream(const testbed::ArmPair& joints, Utime lifetime);
  void order(std::int8_t action);
  void repeat_hold(ArmRole role);
  void send(ArmRole role, std::int8_t action, const Joints& joints, Utime lifetime);
  testbed::ArmPair reference_joints() const;
  Pose relative(const testbed::ArmPair& joints);

  // safety
  void supervise();
  void stop_arms(const std::string& code, const std::string& reason);
  void pause_arms();
  void leave_motion();
  /// At rest before a retreat, and held.
  bool waits_to_retreat() const;
  void resume_when_good();
  void repeat_hold_until_at_rest();
  bool both_reported() const;
  void watch_clearance();
  void watch_rest();
  void learn_dead_time();
  void publish_latency();
  void check_report(ArmRole role, const arm_state_t& state);
  void check_estimate(const pose_estimate_t& message, const testbed::Estimate& estimate);

  void publish_truth(const testbed::Truth& truth);
  void publish_state(bool if_changed);
  testbed_state_t current_state() const;
  void publish_guidance(testbed::GuidanceReport report);
  void publish_chaser_motion(const Pose& commanded);

  Cell cell_;
  RelativePose relative_pose_;
  testbed::Settings settings_;
  testbed::Calibration calibration_;
  RayCaster target_;
  testbed::Clearance clearance_;
  testbed::PathCheck check_;
  testbed::Clearance planning_clearance_;  // this and the next three: the worker's
  testbed::PathCheck planning_check_;
  testbed::MotionPlanner planner_;
  testbed::CommandPlanner commands_;
  testbed::GroundTruth truth_;
  testbed::Guidance guidance_;
  testbed::SafetySupervisor safety_;
  testbed::ReportWatch report_watch_[2];        // replica, sensor
  testbed::FollowingWatch following_watch_[2];  // replica, sensor
  Utime dead_time_;                             // from a set-point to its motion, as used
  setpoint_latency_t latency_{};                // as published; seq 0: not measured yet
  testbed::EstimateWatch estimate_watch_;
  Lease lease_;
  testbed::TimeScale scale_;
  Verdict verdict_;

  testbed::ArmPair reported_;
  bool reported_valid_[2] = {false, false};
  testbed::ArmPair commanded_;
  bool engaged_ = false;                   // both arms follow our set-points
  testbed::JointHistory command_history_;  // as far back as an arm may lag
  Velocity commanded_velocity_;

  Mode mode_ = Mode::idle;
  Task task_;
  std::optional<Planning> planning_;
  SeenCommands seen_;
  bool held_ = false;    // waits for RESUME
  bool paused_ = false;  // stopped; resumes when no partner is silent
  Utime good_since_ = 0;
  Utime hold_ordered_ = 0;
  Utime clearance_checked_ = 0;
  testbed::ArmPair clearance_checked_from_;
  std::optional<testbed::ArmPair> rest_;          // where the arms came to rest
  bool stopping_ = false;                         // comes to rest, then is abandoned
  std::optional<testbed_command2_t> after_stop_;  // a STOP to finish or a RETREAT to begin
  std::string hold_reason_;
  std::string guidance_reason_;             // holds by itself
  std::string abort_reason_;                // guidance has given up: comes to rest
  double override_ = 1;                     // the commander's
  double controller_override_[2] = {1, 1};  // replica, sensor: of the pendant
  Utime last_tick_ = 0;
  Utime next_instant_check_ = 0;

  Utime start_begun_ = 0;
  Utime order_sent_ = 0;
  bool rejoining_ = false;
  testbed::ArmPair rejoin_from_;
  testbed::SmoothTravel rejoin_;
  double rejoin_time_ = 0;

  testbed::TrajectoryHistory trajectory_history_;  // of the motion under way or last done

  std::map<std::string, std::int64_t> last_seq_;  // of each commander's orders
  std::int64_t command_seq_ = 0;
  std::int64_t finished_seq_ = 0;
  std::int64_t refused_seq_ = 0;
  std::string refusal_;
  double clearance_m_ = -1;
  int clearance_countdown_ = 0;

  std::int64_t arm_command_seq_[2] = {0, 0};  ///< replica, sensor: each channel counts its own
  arm_command_t last_hold_[2]{};              ///< replica, sensor: for repetitions
  std::int64_t truth_seq_ = 0;
  std::int64_t state_seq_ = 0;
  std::int64_t guidance_seq_ = 0;
  testbed::ChaserMotion chaser_motion_;  // in closed loop
  std::int64_t inertial_seq_ = 0;
  double setpoints_refused_ = 0;
  std::string refused_setpoint_;  // its commander
  testbed_state_t published_{};
  Loop::TimerId tick_timer_;
  Loop::TimerId state_timer_;
  Loop::TimerId latency_timer_;
};

/// Reads the run's layout, target, calibration and config/testbed.yaml. @throws InputError.
std::unique_ptr<Node> make_testbed_node(NodeSetup setup, const RunSetup& run, Bus& bus, Loop& loop);

}  // namespace berth
