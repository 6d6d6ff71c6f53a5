// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <berth/event_t.hpp>

#include "procedures/engine/engine.h"

namespace berth::procedures {
namespace {

/// Steps that last as long as their motion does.
bool lasts_as_its_motion(const Verb& verb) {
  return std::holds_alternative<Move>(verb) || std::holds_alternative<Trajectory>(verb) ||
         std::holds_alternative<Retreat>(verb) || std::holds_alternative<Approach>(verb);
}

/// Steps that make the estimator track the target.
bool seeks_target(const Verb& verb) {
  return std::holds_alternative<Acquire>(verb) || std::holds_alternative<Track>(verb);
}

std::int8_t outcome_of_step(std::int8_t step_state) {
  switch (step_state) {
    case procedure_step_t::TIMEOUT:
      return procedure_state_t::TIMEOUT;
    case procedure_step_t::FAILED:
      return procedure_state_t::FAIL;
    default:
      return procedure_state_t::ERROR;
  }
}

}  // namespace

Utime Engine::active(Utime now) const {
  const auto& step = state_.steps[static_cast<std::size_t>(state_.current_step)];
  const Utime on_hold = held_total_ + (hold_ == Hold::in_step ? now - held_since_ : 0);
  return now - step.utime_start - on_hold;
}

void Engine::count_slow_time(Utime now) {
  const Utime passed = now - std::max(counted_until_, current().utime_start);
  counted_until_ = now;
  if (!lasts_as_its_motion(step(state_.current_step).verb)) return;
  slowed_ += static_cast<Utime>(static_cast<double>(passed) * (1 - bench_.testbed.override()));
}

int Engine::pass_gates(int index, int end, Utime now) {
  bench_.live.set_time(now);
  while (index < end) {
    int skipped = 0;
    std::string why;
    for (const Gate& gate : step(index).gates) {
      std::string found;
      if (gate.condition.met(bench_.live, found)) continue;
      skipped = gate.steps;
      why = found + "; only if " + gate.condition.text;
      break;
    }
    if (skipped == 0) return index;
    for (int i = 0; i < skipped; ++i, ++index) {
      shown(index).state = procedure_step_t::SKIPPED;
      shown(index).detail = why;
    }
    actions_.event(event_t::INFO, "steps-left-out",
                   std::to_string(skipped) + " from '" + shown(index - skipped).name + "': " + why);
    ++revision_;
  }
  return index;
}

void Engine::begin_step(int index, Utime now) {
  if (index < main_steps()) {
    index = pass_gates(index, main_steps(), now);
    if (index == main_steps()) return conclude(procedure_state_t::NONE, "", now);
  }
  const bool same_phase = state_.current_step >= 0 && current().phase == shown(index).phase;
  state_.current_step = index;
  if (!same_phase) bench_.live.begin_phase(now);
  current().state = procedure_step_t::RUNNING;
  current().utime_start = now;
  current().utime_end = 0;
  current().detail.clear();
  ++current().attempts;
  held_total_ = slowed_ = 0;
  const Verb& verb = step(index).verb;
  if (std::holds_alternative<Acquire>(verb) || std::holds_alternative<StopTracking>(verb)) {
    tracking_expected_ = lost_ = false;
  }
  start_runner(now);
}

void Engine::start_runner(Utime now) {
  bench_.live.begin_step(now);
  runner_ = std::visit([](const auto& verb) { return make(verb); }, step(state_.current_step).verb);
  ++revision_;
  runner_->begin(bench_, now);
  show_prompt(now);
  hold_when_due(now);
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
  const Utime active = this->active(now);
  count_slow_time(now);
  const StepResult result = runner_->poll(bench_, now, active);
  current().detail = runner_->detail();
  const std::string label = "step '" + step.name + "'";
  const std::string because = current().detail.empty() ? "" : ": " + current().detail;
  switch (result) {
    case StepResult::passed:
      return step_passed(now);
    case StepResult::failed:
      return step_failed(procedure_step_t::FAILED, label + because, now);
    case StepResult::error:
      return step_failed(procedure_step_t::ERROR, label + because, now);
    case StepResult::running:
      if (seconds(active - slowed_) <= step.timeout) return;
      if (const Prompt* prompt = runner_->prompt(); prompt && !prompt->default_value.empty()) {
        return runner_->answer(prompt->default_value, "default, no answer in time");
      }
      return step_failed(
          procedure_step_t::TIMEOUT,
          label + " is not done after " + std::to_string(active / second) + " s" + because, now);
  }
}

void Engine::step_passed(Utime now) {
  if (seeks_target(step(state_.current_step).verb)) {
    tracking_expected_ = true;
    lost_ = false;
    last_good_estimate_ = now;
  }
  end_step(procedure_step_t::PASSED, current().detail, now);
  show_prompt(now);
  next_step(now);
}

void Engine::step_failed(std::int8_t step_state, const std::string& reason, Utime now) {
  const int index = state_.current_step;
  const OnFailure& on_failure = step(index).on_failure;
  const bool again = current().attempts <= on_failure.retries;
  const bool hold_it = on_failure.then == OnFailure::Then::hold;
  if (!again && (on_failure.then == OnFailure::Then::abort || (hold_it && !options_.attended))) {
    return conclude(outcome_of_step(step_state), reason + (hold_it ? unattended : ""), now);
  }
  end_step(step_state, reason, now);
  show_prompt(now);
  if (seeks_target(step(index).verb)) tracking_expected_ = false;
  if (again) {
    actions_.event(event_t::WARNING, "step-tried-again", reason);
    return stop_and_begin(index, now);
  }
  if (on_failure.then == OnFailure::Then::go_on) {
    actions_.event(event_t::WARNING, "step-failed", reason + "; goes on all the same");
    return stop_and_begin(index + 1, now);
  }
  actions_.event(event_t::WARNING, "step-failed", reason);
  bench_.testbed.order(testbed_command2_t::STOP, now);
  hold(Hold::failed, reason + ". Retry, skip or abort", now);
}

void Engine::leave_step(const std::string& reason, Utime now) {
  const int index = state_.current_step;
  end_step(procedure_step_t::FAILED, reason, now);
  show_prompt(now);
  actions_.event(event_t::WARNING, "step-left",
                 "step '" + step(index).name + "' is left: " + reason);
  stop_and_begin(index + 1, now);
}

void Engine::stop_and_begin(int index, Utime now) {
  next_ = index;
  bench_.testbed.order(testbed_command2_t::STOP, now);
  enter(Stage::stopping_step, now);
}

void Engine::poll_stopping_step(Utime now) {
  if (stage_ != Stage::stopping_step) return;
  if (!bench_.testbed.order_pending() && bench_.testbed.at_rest()) {
    enter(Stage::running, now);
    if (next_ > state_.current_step) return next_step(now);
    begin_step(next_, now);
  } else if (now - stage_start_ > 10 * second) {
    conclude(procedure_state_t::ERROR, "the testbed does not stop", now);
  }
}

void Engine::next_step(Utime now) {
  if (state_.current_step + 1 == main_steps()) {
    return conclude(procedure_state_t::NONE, "", now);
  }
  if (hold_after_step_) {
    hold_after_step_ = false;
    return hold(Hold::between, "held before the next step", now);
  }
  begin_step(state_.current_step + 1, now);
}

void Engine::show_prompt(Utime now) {
  const Prompt* prompt = runner_ && in_steps() ? runner_->prompt() : nullptr;
  const std::string id = prompt == nullptr ? ""
                                           : std::to_string(state_.current_step + 1) + "." +
                                                 std::to_string(current().attempts);
  if (id.empty() && state_.prompt_id.empty()) return;
  state_.prompt_id = id;
  state_.prompt = prompt ? prompt->text : "";
  state_.choices = prompt ? prompt->choices : std::vector<std::string>();
  state_.choice_count = static_cast<std::int32_t>(state_.choices.size());
  state_.utime_prompt_expires =
      prompt ? now - active(now) + utime_from_seconds(step(state_.current_step).timeout) : 0;
  if (held() || !in_steps()) {
    ++revision_;
  } else {
    show(prompt ? procedure_state_t::PROMPTING : procedure_state_t::RUNNING);
  }
}

}  // namespace berth::procedures
