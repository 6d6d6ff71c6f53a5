// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/operator_control_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/commands.h"
#include "evaluation/run/run_record.h"
#include "procedures/engine/limit_watch.h"
#include "procedures/engine/node_watch.h"
#include "procedures/engine/operator_control.h"
#include "procedures/engine/preconditions.h"
#include "procedures/engine/step_runner.h"

namespace berth::procedures {

struct EngineOptions {
  Commander commander;
  std::vector<std::string> required_nodes;  ///< must be ready to start and to go on
  /// Of the required nodes, the one whose FAULT is final: it is not waited for. Empty: none.
  std::string supervisor;
  /// Required nodes that the user starts, each with instructions, which are shown until it comes.
  std::map<std::string, std::string> outside;
  Utime ready_timeout = 120 * second;  ///< for all of them to be ready
  Utime lease_timeout = 15 * second;   ///< until the lease is granted and preconditions are met
  Utime heartbeat_timeout = second;    ///< silence after which a node is lost
  /// Whether an operator may attend. Not so in the twin: steps that would wait for one end.
  bool attended = true;
  /// Further preconditions, such as room on the disk; empty: none.
  std::function<std::vector<precondition_t>()> more_preconditions;
};

/// Runs a procedure: waits for the nodes, takes the lease, goes from step to step, monitors the rig
/// and the limits, obeys the operator, always runs the teardown, judges. Driven by messages and
/// ticks; commands leave through Actions.
class Engine {
 public:
  Engine(Procedure procedure, EngineOptions options, evaluation::NearestPoint nearest,
         Actions& actions);

  /// Whether a criterion rests on SCAN_DATA.
  bool judges_returns() const;

  void start(Utime now);
  void on(const testbed_state_t& message, Utime now);
  void on(const estimator_state_t& message, Utime now);
  void on(const facility_state_t& message, Utime now);
  void on(const lidar_state_t& message, Utime now);
  void on(const injection_state_t& message, Utime now);
  void on(const pose_estimate_t& message, Utime now);
  void on(const ground_truth_t& message);
  void on(const run_info_t& message) {
    record_.add(message);
    bench_.live.on(message);
  }
  void on(const estimator_diagnostics_t& message) { record_.add(message); }
  void on(const ScanPacket& message) { record_.add(message); }
  void on(const setpoint_latency_t& message) { record_.add(message); }
  /// Records its own commands.
  void on(const testbed_command2_t& message) { record_.add(message); }
  void on(const injection_t& message) { record_.add(message); }
  void on(const event_t& message) { record_.add(message); }
  void on(const node_status_t& message, Utime now);
  void on(const heartbeat_t& message, Utime now) { nodes_.on(message, now); }
  void on(const command_answers_t& facility, Utime now);
  /// Call once for each command, however often it is repeated. HOLD and ABORT are obeyed whatever
  /// their session and age, the others of this session alone. @return the refusal; empty: obeyed
  std::string obey(const procedure_command_t& message, Utime now);
  /// At 20 Hz or more.
  void tick(Utime now);

  bool finished() const { return stage_ == Stage::finished; }
  /// Grows with every change that observers should see at once.
  int revision() const { return revision_; }
  /// The state to publish now. Fits into one message.
  const procedure_state_t& snapshot(Utime now);
  /// The holder of control, to publish with every state.
  operator_control_t control(Utime now);
  std::int8_t outcome() const { return state_.outcome; }
  const Procedure& procedure() const { return procedure_; }

 private:
  static constexpr const char* unattended = "; no operator to decide";

  enum class Stage {
    nodes,
    lease,
    clear,
    running,
    stopping_step,
    stopping,
    teardown,
    settling,
    finished
  };
  /// State of hold: none, within a step, before the next one (both on request), or after a failed
  /// step.
  enum class Hold { none, in_step, between, failed };

  // engine.cpp: messages, preparation, the watch in the background
  void enter(Stage stage, Utime now);
  void show(std::int8_t state);
  void wait_for_nodes(Utime now);
  void wait_for_lease(Utime now);
  void wait_until_clear(Utime now);
  /// Updates the published preconditions. @return the unmet ones as text
  std::string look_at_preconditions(bool going_on);
  void watch(Utime now);
  std::string trouble_with_testbed(Utime now) const;
  /// Why the arms were stopped without a request; empty: they were not.
  std::string stopped_by_itself(Utime now) const;
  /// On hold, until an operator has reset the alarm and resumes.
  void wait_out_alarm(const std::string& stopped, Utime now);
  /// No good estimate for too long: applies `when_lost` of the step under way.
  void target_lost(Utime now);
  void watch_limits(Utime now);

  // engine_end.cpp: teardown and verdict
  /// Ends the steps; a bad outcome stops the arms first. NONE: the criteria decide.
  void conclude(std::int8_t outcome, const std::string& reason, Utime now);
  void begin_teardown(Utime now);
  void begin_teardown_step(int index, Utime now);
  void poll_teardown(Utime now);
  void settle(Utime now);
  void judge(Utime now);

  // engine_steps.cpp: from step to step
  void begin_step(int index, Utime now);
  /// Skips the steps whose conditions are not met, from this one on. @return the first that is
  /// to run, or end
  int pass_gates(int index, int end, Utime now);
  void start_runner(Utime now);
  void end_step(std::int8_t step_state, const std::string& detail, Utime now);
  void poll_step(Utime now);
  /// Extends the time-out of a motion that the operator has slowed down.
  void count_slow_time(Utime now);
  void step_passed(Utime now);
  void step_failed(std::int8_t step_state, const std::string& reason, Utime now);
  /// On to the next step, with an event that gives the reason.
  void leave_step(const std::string& reason, Utime now);
  /// Brings the arms to rest, then begins the step given.
  void stop_and_begin(int index, Utime now);
  void poll_stopping_step(Utime now);
  void next_step(Utime now);
  void show_prompt(Utime now);

  // engine_commands.cpp: the requests of an operator. They return the refusal; empty: done.
  std::string carry_out(const procedure_command_t& message, Utime now);
  void abort(const std::string& reason, Utime now);
  void hold(Hold how, const std::string& reason, Utime now);
  std::string request_hold(const std::string& holder, Utime now);
  std::string request_resume(bool one_step, Utime now);
  std::string request_step(Utime now);
  std::string request_skip(const std::string& reason, Utime now);
  std::string request_retry(Utime now);
  std::string request_reset(Utime now);
  std::string request_answer(const procedure_command_t& message, Utime now);
  std::string request_speed(const std::string& text, Utime now);
  std::string request_lamps(const std::string& text, Utime now);
  std::string request_take_control(const procedure_command_t& message, Utime now);
  std::string request_release_control(const std::string& commander, Utime now);
  void watch_control(Utime now);
  void hold_when_due(Utime now);
  /// Updates the preconditions. @return the unmet ones
  std::string unmet_to_go_on(Utime now);
  void end_hold(Utime now);

  bool in_preparation() const {
    return stage_ == Stage::nodes || stage_ == Stage::lease || stage_ == Stage::clear;
  }
  bool in_steps() const { return stage_ == Stage::running || stage_ == Stage::stopping_step; }
  bool held() const { return hold_ != Hold::none; }
  int main_steps() const { return static_cast<int>(procedure_.steps.size()); }
  const Step& step(int index) const;
  procedure_step_t& shown(int index) { return state_.steps[static_cast<std::size_t>(index)]; }
  procedure_step_t& current() { return shown(state_.current_step); }
  /// Duration of the current step, without time on hold.
  Utime active(Utime now) const;

  Procedure procedure_;
  EngineOptions options_;
  evaluation::NearestPoint nearest_;
  Actions& actions_;
  Bench bench_;
  evaluation::RunRecord record_;
  NodeWatch nodes_;
  LimitWatch limits_;
  RestWatch rest_;
  OperatorControl control_;
  std::int64_t control_seq_ = 0;
  std::string hold_due_;        // reason of a hold that begins as soon as a step runs; empty: none
  std::string hold_requested_;  // the same, of an operator's request

  Stage stage_ = Stage::nodes;
  Utime stage_start_ = 0;
  procedure_state_t state_{};
  procedure_state_t shortened_{};                  // the last state published without details
  std::int8_t verdict_ = procedure_state_t::NONE;  // shown when FINISHED
  std::int64_t seq_ = 0;
  int revision_ = 0;

  std::unique_ptr<StepRunner> runner_;
  int next_ = 0;  // step to begin when the arms have come to rest
  Hold hold_ = Hold::none;
  std::string alarm_;  // that stopped the arms, on hold; empty: none
  Utime held_since_ = 0;
  Utime held_total_ = 0;  // of the current step
  Utime slowed_ = 0;      // of the current step: delay of its motion by a lower speed
  Utime counted_until_ = 0;
  Utime resumed_ = 0;
  bool hold_after_step_ = false;
  bool tracking_expected_ = false;
  bool lost_ = false;  // the target, and not expected until it is found again
  Utime last_good_estimate_ = 0;
  Utime not_ready_since_ = 0;  // of the testbed; 0: it is ready
  Utime limits_looked_at_ = 0;
  bool reset_sent_ = false;
  bool stop_sent_ = false;
  bool hurry_ = false;  // aborted twice: no more teardown steps
};

}  // namespace berth::procedures
