// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/engine.h"

#include <algorithm>
#include <berth/event_t.hpp>
#include <utility>

#include "common/bus/bus.h"
#include "lcmtypes/good_estimate.h"

namespace berth::procedures {
namespace {

std::string in_seconds(Utime t) { return std::to_string(t / second) + " s"; }

bool same(const precondition_t& a, const precondition_t& b) {
  return a.name == b.name && a.met == b.met && a.reason == b.reason;
}

/// Without the steps' details, for a procedure with many steps.
procedure_state_t shortened(procedure_state_t state) {
  for (procedure_step_t& step : state.steps) {
    if (step.state == procedure_step_t::PASSED) step.detail.clear();
  }
  constexpr std::size_t enough = 40;
  if (state.getEncodedSize() <= Bus::max_message_bytes) return state;
  for (procedure_step_t& step : state.steps) {
    std::size_t end = std::min(enough, step.detail.size());
    while (end < step.detail.size() && (step.detail[end] & 0xc0) == 0x80) --end;  // within UTF-8
    step.detail.resize(end);
  }
  return state;
}

}  // namespace

Engine::Engine(Procedure procedure, EngineOptions options, evaluation::NearestPoint nearest,
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
             RunMessages(nearest_)},
      nodes_(options_.required_nodes, options_.supervisor, options_.outside),
      limits_(procedure_.limits) {
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
      shown.depth = static_cast<std::int8_t>(step.depth);
      state_.steps.push_back(shown);
    }
  }
  state_.step_count = static_cast<std::int32_t>(state_.steps.size());
}

const Step& Engine::step(int index) const {
  return index < main_steps() ? procedure_.steps[static_cast<std::size_t>(index)]
                              : procedure_.teardown[static_cast<std::size_t>(index - main_steps())];
}

const procedure_state_t& Engine::snapshot(Utime now) {
  state_.utime = now;
  state_.seq = ++seq_;
  state_.limits = limits_.results();
  state_.limit_count = static_cast<std::int32_t>(state_.limits.size());
  if (state_.getEncodedSize() <= Bus::max_message_bytes) return state_;
  return shortened_ = shortened(state_);
}

operator_control_t Engine::control(Utime now) {
  operator_control_t control = control_.state(now);
  control.seq = ++control_seq_;
  control.session = options_.commander.session;
  return control;
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
  nodes_.start(now);
  enter(Stage::nodes, now);
}

// Messages ----------------------------------------------------------------------------------------

void Engine::on(const testbed_state_t& message, Utime now) {
  record_.add(message);
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

void Engine::on(const command_answers_t& facility, Utime now) {
  bench_.facility.on(facility);
  tick(now);
}

void Engine::on(const lidar_state_t& message, Utime now) {
  bench_.live.on(message);
  tick(now);
}

void Engine::on(const injection_state_t& message, Utime now) {
  record_.add(message);
  bench_.injections.on(message);
  tick(now);
}

void Engine::on(const ground_truth_t& message) {
  record_.add(message);
  bench_.live.on(message);
}

void Engine::on(const pose_estimate_t& message, Utime now) {
  record_.add(message);
  bench_.live.on(message, now);
  if (is_good(message)) {
    last_good_estimate_ = now;
    if (std::exchange(lost_, false)) tracking_expected_ = true;
  }
  if (runner_ != nullptr) runner_->on_estimate(bench_, message);
  tick(now);
}

void Engine::on(const node_status_t& message, Utime now) {
  nodes_.on(message);
  tick(now);
}

void Engine::tick(Utime now) {
  bench_.live.set_time(now);
  bench_.testbed.tick(now);
  bench_.estimator.tick(now);
  bench_.facility.tick(now);
  bench_.injections.tick(now);
  watch_control(now);
  if (in_preparation()) look_at_preconditions(false);
  switch (stage_) {
    case Stage::nodes:
      return wait_for_nodes(now);
    case Stage::lease:
      return wait_for_lease(now);
    case Stage::clear:
      return wait_until_clear(now);
    case Stage::running:
    case Stage::stopping_step:
      if (held()) rest_.look(bench_);
      watch(now);
      if (stage_ == Stage::stopping_step) return poll_stopping_step(now);
      if (stage_ == Stage::running && !held()) poll_step(now);
      return;
    case Stage::stopping: {
      const bool still = !bench_.testbed.order_pending() && bench_.testbed.at_rest();
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

std::string Engine::look_at_preconditions(bool going_on) {
  auto list = preconditions(nodes_, bench_, going_on);
  if (options_.more_preconditions) {
    for (precondition_t& more : options_.more_preconditions()) list.push_back(std::move(more));
  }
  if (going_on) {
    list.push_back(rest_.precondition(bench_));
    if (const std::string broken = limits_.broken_now(); !broken.empty()) {
      list.push_back(make_precondition("limits", false, broken));
    }
  }
  if (!std::equal(list.begin(), list.end(), state_.preconditions.begin(),
                  state_.preconditions.end(), same)) {
    state_.preconditions = std::move(list);
    state_.precondition_count = static_cast<std::int32_t>(state_.preconditions.size());
    ++revision_;
  }
  return unmet(state_.preconditions);
}

void Engine::wait_for_nodes(Utime now) {
  if (const std::string fault = nodes_.final_fault(); !fault.empty()) {
    return conclude(procedure_state_t::ERROR, fault, now);
  }
  const std::string missing = nodes_.missing();
  state_.reason = missing.empty() ? "" : "waiting for " + nodes_.awaited();
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
  if (!reset_sent_ && testbed.state == testbed_state_t::FAULT) {
    reset_sent_ = true;
    bench_.testbed.order(testbed_command2_t::RESET, now);
  }
  if (!stop_sent_ && testbed.state == testbed_state_t::HELD) {  // the motion of another commander
    stop_sent_ = true;
    bench_.testbed.order(testbed_command2_t::STOP, now);
  }
  const std::string wrong = unmet(state_.preconditions);
  if (wrong.empty()) {
    state_.reason.clear();
    show(procedure_state_t::RUNNING);
    enter(Stage::running, now);
    bench_.live.begin_run(now);
    return begin_step(0, now);
  }
  state_.reason = "waiting for " + wrong;
  if (now - stage_start_ > options_.lease_timeout) {
    conclude(procedure_state_t::ERROR, "not ready to move: " + wrong, now);
  }
}

// The watch in the background ---------------------------------------------------------------------

std::string Engine::trouble_with_testbed(Utime now) const {
  const testbed_state_t& testbed = *bench_.testbed.state();
  if (bench_.testbed.lost_lease()) {
    return "lost the lease" +
           (testbed.lease_holder.empty() ? std::string() : " to " + testbed.lease_holder);
  }
  // One late status is no reason to end a run.
  if (not_ready_since_ != 0 && now - not_ready_since_ > 2 * second) {
    return "the testbed is not ready: " + testbed.reason;
  }
  return {};
}

std::string Engine::stopped_by_itself(Utime now) const {
  const testbed_state_t& testbed = *bench_.testbed.state();
  if (testbed.state == testbed_state_t::FAULT) return "testbed fault: " + testbed.reason;
  const bool our_hold = held() || stage_ == Stage::stopping_step || now - resumed_ < 2 * second;
  if (testbed.state == testbed_state_t::HELD && !our_hold) {
    return "the testbed is held: " + testbed.reason;
  }
  return {};
}

void Engine::watch(Utime now) {
  const std::string stopped = stopped_by_itself(now);
  // An attending operator can clear the fault: the run is not over.
  const bool waits =
      !alarm_.empty() || (stage_ == Stage::running && !control_.state(now).holder.empty());
  std::string trouble =
      nodes_.trouble(now, options_.heartbeat_timeout,
                     waits && !(stopped.empty() && alarm_.empty()) ? "testbed" : "");
  if (trouble.empty()) trouble = trouble_with_testbed(now);
  if (trouble.empty() && !waits) trouble = stopped;
  if (!trouble.empty()) return conclude(procedure_state_t::ERROR, trouble, now);
  wait_out_alarm(stopped, now);
  if (tracking_expected_ && seconds(now - last_good_estimate_) > procedure_.lost_for) {
    return target_lost(now);
  }
  watch_limits(now);
}

void Engine::wait_out_alarm(const std::string& stopped, Utime now) {
  if (!stopped.empty() && stopped != alarm_) {
    alarm_ = stopped;
    actions_.event(event_t::ERROR, "stopped-by-alarm", alarm_);
    if (!held()) hold(Hold::in_step, alarm_, now);
  }
  if (alarm_.empty()) return;
  const bool over = stopped.empty() && bench_.testbed.state()->state != testbed_state_t::FAULT;
  const std::string reason =
      alarm_ + (over ? "; resume goes on" : "; put it right, reset, then resume");
  if (reason == state_.reason) return;
  state_.reason = reason;
  look_at_preconditions(true);
  ++revision_;
}

void Engine::target_lost(Utime now) {
  const auto& estimate = bench_.live.estimate;
  const std::string reason = "the estimator lost the target: no good estimate for " +
                             in_seconds(now - last_good_estimate_) +
                             (estimate && !estimate->reason.empty() ? ": " + estimate->reason : "");
  const WhenLost then = step(state_.current_step).when_lost;
  if (then == WhenLost::fail) return conclude(procedure_state_t::FAIL, reason, now);
  const bool runs = stage_ == Stage::running && !held();
  if (then == WhenLost::skip && !runs) return;  // not on hold
  tracking_expected_ = false;
  lost_ = true;
  if (then == WhenLost::skip) leave_step(reason, now);
}

void Engine::watch_limits(Utime now) {
  constexpr Utime period = 50 * millisecond;
  if (now - limits_looked_at_ < period) return;
  limits_looked_at_ = now;
  const auto broken = limits_.look(bench_.live, state_.current_step, current().phase);
  if (!broken) return;
  ++revision_;
  actions_.event(event_t::WARNING, "limit-broken", broken->text);
  switch (broken->then) {
    case Limit::Then::fail:
      return conclude(procedure_state_t::FAIL, broken->text, now);
    case Limit::Then::abort:
      return conclude(procedure_state_t::ABORTED, broken->text, now);
    case Limit::Then::hold:
      if (!options_.attended) {
        return conclude(procedure_state_t::FAIL, broken->text + unattended, now);
      }
      if (stage_ == Stage::running && !held()) hold(Hold::in_step, broken->text, now);
  }
}

}  // namespace berth::procedures
