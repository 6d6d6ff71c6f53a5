// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/engine.h"

#include <algorithm>
#include <berth/event_t.hpp>

namespace berth::procedures {
namespace {

const char* text_of_state(std::int8_t state) {
  constexpr const char* names[] = {"STARTING", "READY", "RUNNING", "DEGRADED", "FAULT", "STOPPED"};
  return state >= 0 && state <= node_status_t::STOPPED ? names[state] : "?";
}

std::string in_seconds(Utime t) { return std::to_string(t / second) + " s"; }

bool moving(const testbed_state_t& state) {
  return state.state == testbed_state_t::MOVING || state.state == testbed_state_t::CLOSED_LOOP;
}

}  // namespace

Engine::Engine(Procedure procedure, EngineOptions options, logs::NearestPoint nearest,
               Actions& actions)
    : procedure_(std::move(procedure)),
      options_(std::move(options)),
      nearest_(std::move(nearest)),
      actions_(actions),
      bench_{actions,
             TestbedLink(actions, options_.commander),
             EstimatorLink(actions, options_.commander),
             FacilityLink(actions, options_.commander),
             InjectionLink(actions, options_.commander),
             Live(nearest_)} {
  for (const std::string& name : options_.required_nodes) nodes_[name] = {};
  state_.session = options_.commander.session;
  state_.procedure = procedure_.name;
  state_.state = procedure_state_t::PREPARING;
  state_.outcome = procedure_state_t::NONE;
  state_.current_step = -1;
  for (const auto* list : {&procedure_.steps, &procedure_.teardown}) {
    for (const Step& step : *list) {
      procedure_step_t shown{};
      shown.name = step.name;
      shown.phase = step.phase;
      state_.steps.push_back(shown);
    }
  }
  state_.step_count = static_cast<std::int32_t>(state_.steps.size());
}

const Step& Engine::step(int index) const {
  return index < main_steps() ? procedure_.steps[static_cast<std::size_t>(index)]
                              : procedure_.teardown[static_cast<std::size_t>(index - main_steps())];
}

procedure_state_t Engine::snapshot(Utime now) {
  state_.utime = now;
  state_.seq = ++seq_;
  return state_;
}

void Engine::enter(Stage stage, Utime now) {
  stage_ = stage;
  stage_start_ = now;
  ++revision_;
}

void Engine::show(std::int8_t state) {
  state_.state = state;
  ++revision_;
}

void Engine::start(Utime now) {
  state_.utime_start = now;
  for (auto& [name, node] : nodes_) node.heartbeat = now;
  enter(Stage::nodes, now);
}

// Messages ----------------------------------------------------------------------------------------

void Engine::on(const testbed_state_t& message, Utime now) {
  bench_.testbed.on(message);
  bench_.live.on(message);
  if (message.state != testbed_state_t::NOT_READY) {
    not_ready_since_ = 0;
  } else if (not_ready_since_ == 0) {
    not_ready_since_ = now;
  }
  tick(now);
}

void Engine::on(const estimator_state_t& message, Utime now) {
  bench_.estimator.on(message, now);
  tick(now);
}

void Engine::on(const facility_state_t& message, Utime now) {
  bench_.facility.on(message);
  bench_.live.on(message);
  tick(now);
}

void Engine::on(const lidar_state_t& message, Utime now) {
  bench_.live.on(message);
  tick(now);
}

void Engine::on(const ground_truth_t& message) {
  record_.add(message);
  bench_.live.on(message);
}

void Engine::on(const injection_state_t& message, Utime now) {
  bench_.injections.on(message);
  tick(now);
}

void Engine::on(const pose_estimate_t& message, Utime now) {
  record_.add(message);
  bench_.live.on(message, now);
  if (message.status == pose_estimate_t::OK) last_good_estimate_ = now;
  if (runner_ != nullptr) runner_->on_estimate(bench_, message);
  tick(now);
}

void Engine::on(const node_status_t& message, Utime now) {
  const auto node = nodes_.find(message.node);
  if (node == nodes_.end()) return;
  node->second.heard = true;
  node->second.state = message.state;
  node->second.reason = message.reason;
  tick(now);
}

void Engine::on(const heartbeat_t& message, Utime now) {
  const auto node = nodes_.find(message.node);
  if (node != nodes_.end()) node->second.heartbeat = now;
}

void Engine::on(const procedure_command_t& message, Utime now) {
  // Several terminals may be attached, one after the other, each counting from 1.
  const bool is_new = commands_seen_.insert({message.commander, message.utime, message.seq}).second;
  if (message.utime_expires < now || !is_new) return;
  switch (message.command) {
    case procedure_command_t::ABORT:
      return abort(message.text.empty() ? "aborted by " + message.commander : message.text, now);
    case procedure_command_t::HOLD:
      return hold(now);
    case procedure_command_t::RESUME:
      hold_after_step_ = false;
      return resume(now);
    case procedure_command_t::STEP:
      hold_after_step_ = true;
      return resume(now);
    case procedure_command_t::SKIP:
      return skip(message.text, now);
    default:
      actions_.event(event_t::WARNING, "procedure-command",
                     "this procedure cannot do what " + message.commander + " asks (command " +
                         std::to_string(message.command) + ")");
  }
}

void Engine::tick(Utime now) {
  bench_.live.set_time(now);
  bench_.testbed.tick(now);
  bench_.estimator.tick(now);
  bench_.facility.tick(now);
  bench_.injections.tick(now);
  switch (stage_) {
    case Stage::nodes:
      return wait_for_nodes(now);
    case Stage::lease:
      return wait_for_lease(now);
    case Stage::clear:
      return wait_until_clear(now);
    case Stage::running:
      watch(now);
      if (stage_ == Stage::running && held_since_ == 0) poll_step(now);
      return;
    case Stage::skipping:
      watch(now);
      if (stage_ != Stage::skipping) return;
      if (bench_.testbed.order_answer() != Answer::pending && !moving(*bench_.testbed.state())) {
        next_step(now);
      } else if (now - stage_start_ > 10 * second) {
        conclude(procedure_state_t::ERROR, "the testbed does not stop", now);
      }
      return;
    case Stage::stopping: {
      const bool still = bench_.testbed.order_answer() != Answer::pending &&
                         bench_.testbed.state() && !moving(*bench_.testbed.state());
      if (still || now - stage_start_ > 5 * second) begin_teardown(now);
      return;
    }
    case Stage::teardown:
      return poll_teardown(now);
    case Stage::settling:
      return settle(now);
    case Stage::finished:
      return;
  }
}

// Preparation -------------------------------------------------------------------------------------

void Engine::wait_for_nodes(Utime now) {
  std::string missing;
  for (const auto& [name, node] : nodes_) {
    if (name == options_.supervisor && node.state == node_status_t::FAULT) {
      return conclude(procedure_state_t::ERROR, node.reason, now);
    }
    if (node.state == node_status_t::READY || node.state == node_status_t::RUNNING) continue;
    missing += missing.empty() ? "" : ", ";
    missing += name + " (" + (node.heard ? text_of_state(node.state) : "not heard of");
    missing += (node.reason.empty() ? "" : ": " + node.reason) + ")";
  }
  state_.reason = missing.empty() ? "" : "waiting for " + missing;
  if (missing.empty()) {
    bench_.testbed.take_lease(now);
    enter(Stage::lease, now);
  } else if (now - stage_start_ > options_.ready_timeout) {
    conclude(procedure_state_t::ERROR,
             "not ready within " + in_seconds(options_.ready_timeout) + ": " + missing, now);
  }
}

void Engine::wait_for_lease(Utime now) {
  if (bench_.testbed.has_lease()) {
    enter(Stage::clear, now);
  } else if (now - stage_start_ > options_.lease_timeout) {
    const auto& testbed = bench_.testbed.state();
    conclude(
        procedure_state_t::ERROR,
        "no lease on the testbed within " + in_seconds(options_.lease_timeout) +
            (testbed && !testbed->lease_holder.empty() ? ": " + testbed->lease_holder + " has it"
                                                       : ""),
        now);
  }
}

void Engine::wait_until_clear(Utime now) {
  const testbed_state_t& testbed = *bench_.testbed.state();
  if (testbed.state == testbed_state_t::IDLE) {
    state_.reason.clear();
    show(procedure_state_t::RUNNING);
    enter(Stage::running, now);
    begin_step(0, now);
    return;
  }
  if (!reset_sent_ &&
      (testbed.state == testbed_state_t::FAULT || testbed.state == testbed_state_t::HELD)) {
    reset_sent_ = true;
    bench_.testbed.order(testbed_command_t::RESET, now);
  }
  if (now - stage_start_ > options_.lease_timeout) {
    conclude(procedure_state_t::ERROR, "the testbed is not ready to move: " + testbed.reason, now);
  }
}

// Steps -------------------------------------------------------------------------------------------

void Engine::begin_step(int index, Utime now) {
  state_.current_step = index;
  current().state = procedure_step_t::RUNNING;
  current().utime_start = now;
  held_total_ = 0;
  const Verb& verb = step(index).verb;
  if (std::holds_alternative<Acquire>(verb) || std::holds_alternative<StopTracking>(verb)) {
    tracking_expected_ = false;
  }
  runner_ = make_runner(step(index));
  ++revision_;
  runner_->begin(bench_, now);
}

void Engine::end_step(std::int8_t step_state, const std::string& detail, Utime now) {
  current().state = step_state;
  current().detail = detail;
  current().utime_end = now;
  runner_.reset();
  ++revision_;
}

void Engine::poll_step(Utime now) {
  const Step& step = this->step(state_.current_step);
  const Utime active = now - current().utime_start - held_total_;
  const StepResult result = runner_->poll(bench_, now, active);
  current().detail = runner_->detail();
  const std::string label = "step '" + step.name + "'";
  const std::string because = current().detail.empty() ? "" : ": " + current().detail;
  switch (result) {
    case StepResult::passed:
      if (std::holds_alternative<Acquire>(step.verb) || std::holds_alternative<Track>(step.verb)) {
        tracking_expected_ = true;
        last_good_estimate_ = now;
      }
      end_step(procedure_step_t::PASSED, current().detail, now);
      return next_step(now);
    case StepResult::failed:
      return conclude(procedure_state_t::FAIL, label + because, now);
    case StepResult::error:
      return conclude(procedure_state_t::ERROR, label + because, now);
    case StepResult::running:
      if (seconds(active) > step.timeout) {
        conclude(procedure_state_t::TIMEOUT,
                 label + " is not done after " + in_seconds(active) + because, now);
      }
      return;
  }
}

void Engine::next_step(Utime now) {
  stage_ = Stage::running;
  if (state_.current_step + 1 == main_steps()) {
    return conclude(procedure_state_t::NONE, "", now);
  }
  if (hold_after_step_) {
    hold_after_step_ = false;
    between_steps_ = true;
    held_since_ = now;
    return show(procedure_state_t::HELD);
  }
  begin_step(state_.current_step + 1, now);
}

void Engine::conclude(std::int8_t outcome, const std::string& reason, Utime now) {
  verdict_ = outcome;
  state_.reason = reason;
  held_since_ = 0;
  if (state_.current_step >= 0 && current().state == procedure_step_t::RUNNING) {
    const std::int8_t step_state = outcome == procedure_state_t::TIMEOUT ? procedure_step_t::TIMEOUT
                                   : outcome == procedure_state_t::ABORTED
                                       ? procedure_step_t::ABORTED
                                   : outcome == procedure_state_t::FAIL ? procedure_step_t::FAILED
                                                                        : procedure_step_t::ERROR;
    end_step(step_state, reason, now);
  }
  if (outcome != procedure_state_t::NONE) {
    actions_.event(outcome == procedure_state_t::ABORTED ? event_t::WARNING : event_t::ERROR,
                   "procedure-stopped", reason);
  }
  show(procedure_state_t::TEARDOWN);
  if (outcome != procedure_state_t::NONE && bench_.testbed.has_lease()) {
    bench_.testbed.order(testbed_command_t::STOP, now);
    enter(Stage::stopping, now);
  } else {
    begin_teardown(now);
  }
}

// Teardown and verdict ----------------------------------------------------------------------------

void Engine::begin_teardown(Utime now) {
  enter(Stage::teardown, now);
  // Without a lease nothing was commanded and nothing would be obeyed.
  if (hurry_ || procedure_.teardown.empty() || state_.current_step < 0) {
    bench_.testbed.release_lease(now);
    return enter(Stage::settling, now);
  }
  begin_step(main_steps(), now);
}

void Engine::poll_teardown(Utime now) {
  const Step& step = this->step(state_.current_step);
  const Utime active = now - current().utime_start;
  const StepResult result = runner_->poll(bench_, now, active);
  const std::string detail = runner_->detail();
  if (result == StepResult::running && seconds(active) <= std::min(step.timeout, 20.0) && !hurry_) {
    return;
  }
  if (result == StepResult::passed) {
    end_step(procedure_step_t::PASSED, detail, now);
  } else {
    const std::string why = "teardown step '" + step.name +
                            "' failed: " + (detail.empty() ? "no answer in time" : detail);
    end_step(result == StepResult::running ? procedure_step_t::TIMEOUT : procedure_step_t::ERROR,
             detail, now);
    actions_.event(event_t::ERROR, "teardown-failed", why);
    if (verdict_ == procedure_state_t::NONE) {
      verdict_ = procedure_state_t::ERROR;
      state_.reason = why;
    }
  }
  if (state_.current_step + 1 < state_.step_count && !hurry_) {
    return begin_step(state_.current_step + 1, now);
  }
  bench_.testbed.release_lease(now);
  enter(Stage::settling, now);
}

/// Truth comes some time after the moment it is true for, and so does the last estimate.
void Engine::settle(Utime now) {
  constexpr Utime shortest = second;
  constexpr Utime longest = 5 * second;
  const Utime waited = now - stage_start_;
  Utime end = 0;
  for (int i = 0; i < main_steps(); ++i) {
    end = std::max(end, state_.steps[static_cast<std::size_t>(i)].utime_end);
  }
  const auto& truth = record_.truth().samples();
  const bool truth_has_come = end == 0 || (!truth.empty() && truth.back().utime >= end);
  if ((waited >= shortest && truth_has_come) || waited >= longest) judge(now);
}

void Engine::judge(Utime now) {
  record_.add(snapshot(now));
  const logs::Measurer measurer(record_, nearest_);
  state_.criteria = logs::judge(procedure_.criteria, measurer);
  state_.criterion_count = static_cast<std::int32_t>(state_.criteria.size());
  state_.outcome =
      verdict_ == procedure_state_t::NONE ? logs::outcome_of(state_.criteria) : verdict_;
  state_.current_step = -1;
  show(procedure_state_t::FINISHED);
  enter(Stage::finished, now);
}

// The watch in the background ---------------------------------------------------------------------

std::string Engine::trouble_with_nodes(Utime now) const {
  for (const auto& [name, node] : nodes_) {
    if (node.state == node_status_t::FAULT || node.state == node_status_t::STOPPED) {
      return "node " + name + ": " + text_of_state(node.state) +
             (node.reason.empty() ? "" : ": " + node.reason);
    }
    if (now - node.heartbeat > options_.heartbeat_timeout) {
      return "node " + name + " is silent";
    }
  }
  return {};
}

std::string Engine::trouble_with_testbed(Utime now) const {
  const testbed_state_t& testbed = *bench_.testbed.state();
  if (bench_.testbed.lost_lease()) {
    return "lost the lease" +
           (testbed.lease_holder.empty() ? std::string() : " to " + testbed.lease_holder);
  }
  if (testbed.state == testbed_state_t::FAULT) return "testbed fault: " + testbed.reason;
  // One late status is no reason to end a run.
  if (not_ready_since_ != 0 && now - not_ready_since_ > 2 * second) {
    return "the testbed is not ready: " + testbed.reason;
  }
  const bool our_hold = held_since_ != 0 || now - resumed_ < 2 * second;
  if (testbed.state == testbed_state_t::HELD && !our_hold) {
    return "the testbed is held: " + testbed.reason;
  }
  return {};
}

void Engine::watch(Utime now) {
  std::string trouble = trouble_with_nodes(now);
  if (trouble.empty()) trouble = trouble_with_testbed(now);
  if (!trouble.empty()) return conclude(procedure_state_t::ERROR, trouble, now);
  if (tracking_expected_ && seconds(now - last_good_estimate_) > procedure_.lost_for) {
    const auto& estimate = bench_.live.estimate();
    const bool reason = estimate && !estimate->reason.empty();
    conclude(procedure_state_t::FAIL,
             "the estimator lost the target: no good estimate for " +
                 in_seconds(now - last_good_estimate_) + (reason ? ": " + estimate->reason : ""),
             now);
  }
}

// What an operator asks ---------------------------------------------------------------------------

void Engine::abort(const std::string& reason, Utime now) {
  if (in_preparation() || in_steps()) {
    conclude(procedure_state_t::ABORTED, reason, now);
  } else if (stage_ != Stage::finished) {
    hurry_ = true;
  }
}

void Engine::hold(Utime now) {
  if (stage_ != Stage::running || held_since_ != 0) return;
  held_since_ = now;
  bench_.testbed.order(testbed_command_t::HOLD, now);
  show(procedure_state_t::HELD);
}

void Engine::resume(Utime now) {
  if (stage_ != Stage::running || held_since_ == 0) return;
  held_total_ += now - held_since_;
  held_since_ = 0;
  resumed_ = now;
  show(procedure_state_t::RUNNING);
  if (between_steps_) {
    between_steps_ = false;
    return begin_step(state_.current_step + 1, now);
  }
  // Steps that move nothing were held by us alone.
  if (bench_.testbed.state()->state != testbed_state_t::IDLE) {
    bench_.testbed.order(testbed_command_t::RESUME, now);
  }
}

void Engine::skip(const std::string& reason, Utime now) {
  if (stage_ != Stage::running || between_steps_) return;
  if (held_since_ != 0) {
    held_since_ = 0;
    resumed_ = now;
    show(procedure_state_t::RUNNING);
  }
  actions_.event(event_t::NOTICE, "step-skipped",
                 "step '" + current().name + "' skipped: " + reason);
  end_step(procedure_step_t::SKIPPED, reason, now);
  bench_.testbed.order(testbed_command_t::STOP, now);
  enter(Stage::skipping, now);
}

}  // namespace berth::procedures
