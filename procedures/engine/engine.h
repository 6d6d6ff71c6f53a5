// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/heartbeat_t.hpp>
#include <berth/node_status_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "logs/run/run_record.h"
#include "procedures/engine/step_runner.h"

namespace berth::procedures {

struct EngineOptions {
  Commander commander;
  std::vector<std::string> required_nodes;  ///< without which nothing starts or goes on
  /// Of the required nodes, the one whose FAULT is final: it is not waited for. Empty: none.
  std::string supervisor;
  Utime ready_timeout = 120 * second;  ///< for all of them to be ready
  Utime lease_timeout = 15 * second;   ///< for the testbed to give the lease and be idle
  Utime heartbeat_timeout = second;    ///< silence after which a node is lost
};

/// Runs a procedure: waits for the nodes, takes the lease, goes from step to step, watches the rig
/// in the background, always tears down, judges. Driven by messages and ticks; commands leave
/// through Actions.
class Engine {
 public:
  Engine(Procedure procedure, EngineOptions options, logs::NearestPoint nearest, Actions& actions);

  void start(Utime now);
  void on(const testbed_state_t& message, Utime now);
  void on(const estimator_state_t& message, Utime now);
  void on(const facility_state_t& message, Utime now);
  void on(const lidar_state_t& message, Utime now);
  void on(const pose_estimate_t& message, Utime now);
  void on(const ground_truth_t& message);
  void on(const injection_state_t& message, Utime now);
  void on(const run_info_t& message) { record_.add(message); }
  void on(const node_status_t& message, Utime now);
  void on(const heartbeat_t& message, Utime now);
  void on(const procedure_command_t& message, Utime now);
  /// At 20 Hz or more.
  void tick(Utime now);

  bool finished() const { return stage_ == Stage::finished; }
  /// Grows with every change that observers should see at once.
  int revision() const { return revision_; }
  /// The state to publish now.
  procedure_state_t snapshot(Utime now);
  std::int8_t outcome() const { return state_.outcome; }
  const Procedure& procedure() const { return procedure_; }

 private:
  enum class Stage {
    nodes,
    lease,
    clear,
    running,
    skipping,
    stopping,
    teardown,
    settling,
    finished
  };

  struct NodeWatch {
    std::int8_t state = node_status_t::STARTING;
    std::string reason;
    bool heard = false;
    Utime heartbeat = 0;
  };

  bool in_preparation() const {
    return stage_ == Stage::nodes || stage_ == Stage::lease || stage_ == Stage::clear;
  }
  bool in_steps() const { return stage_ == Stage::running || stage_ == Stage::skipping; }
  void enter(Stage stage, Utime now);
  void show(std::int8_t state);

  void wait_for_nodes(Utime now);
  void wait_for_lease(Utime now);
  void wait_until_clear(Utime now);
  void begin_step(int index, Utime now);
  void end_step(std::int8_t step_state, const std::string& detail, Utime now);
  void poll_step(Utime now);
  void next_step(Utime now);
  /// Ends the steps; a bad outcome stops the arms first. NONE: the criteria decide.
  void conclude(std::int8_t outcome, const std::string& reason, Utime now);
  void begin_teardown(Utime now);
  void poll_teardown(Utime now);
  void settle(Utime now);
  void judge(Utime now);

  /// What is wrong with the rig; empty when nothing is.
  std::string trouble_with_nodes(Utime now) const;
  std::string trouble_with_testbed(Utime now) const;
  void watch(Utime now);

  void abort(const std::string& reason, Utime now);
  void hold(Utime now);
  void resume(Utime now);
  void skip(const std::string& reason, Utime now);

  int main_steps() const { return static_cast<int>(procedure_.steps.size()); }
  const Step& step(int index) const;
  procedure_step_t& current() {
    return state_.steps[static_cast<std::size_t>(state_.current_step)];
  }

  Procedure procedure_;
  EngineOptions options_;
  logs::NearestPoint nearest_;
  Actions& actions_;
  Bench bench_;
  logs::RunRecord record_;
  std::map<std::string, NodeWatch> nodes_;

  Stage stage_ = Stage::nodes;
  Utime stage_start_ = 0;
  procedure_state_t state_{};
  std::int8_t verdict_ = procedure_state_t::NONE;  // shown when FINISHED
  std::int64_t seq_ = 0;
  int revision_ = 0;

  std::unique_ptr<StepRunner> runner_;
  Utime held_total_ = 0;  // of the current step
  Utime held_since_ = 0;  // 0: not held
  Utime resumed_ = 0;
  bool hold_after_step_ = false;
  bool between_steps_ = false;  // held after one step and before the next
  bool tracking_expected_ = false;
  Utime last_good_estimate_ = 0;
  Utime not_ready_since_ = 0;  // of the testbed; 0: it is ready
  bool reset_sent_ = false;
  bool hurry_ = false;  // aborted twice: no more teardown steps
  std::set<std::tuple<std::string, Utime, std::int64_t>> commands_seen_;
};

}  // namespace berth::procedures
