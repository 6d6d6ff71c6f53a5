// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <berth/event_t.hpp>

#include "procedures/engine/engine.h"

namespace berth::procedures {
namespace {

std::int8_t step_state_of(std::int8_t outcome) {
  switch (outcome) {
    case procedure_state_t::TIMEOUT:
      return procedure_step_t::TIMEOUT;
    case procedure_state_t::ABORTED:
      return procedure_step_t::ABORTED;
    case procedure_state_t::FAIL:
      return procedure_step_t::FAILED;
    default:
      return procedure_step_t::ERROR;
  }
}

}  // namespace

void Engine::conclude(std::int8_t outcome, const std::string& reason, Utime now) {
  verdict_ = outcome;
  state_.reason = reason;
  hold_ = Hold::none;
  if (state_.current_step >= 0 && current().state == procedure_step_t::RUNNING) {
    end_step(step_state_of(outcome), reason, now);
  }
  show_prompt(now);
  if (outcome != procedure_state_t::NONE) {
    actions_.event(outcome == procedure_state_t::ABORTED ? event_t::WARNING : event_t::ERROR,
                   "procedure-stopped", reason);
  }
  show(procedure_state_t::TEARDOWN);
  if (outcome == procedure_state_t::NONE || state_.current_step < 0) return begin_teardown(now);
  bench_.testbed.order(testbed_command2_t::STOP, now);
  enter(Stage::stopping, now);
}

void Engine::begin_teardown(Utime now) {
  enter(Stage::teardown, now);
  // Without a lease no command was sent, and none would be obeyed.
  if (hurry_ || procedure_.teardown.empty() || state_.current_step < 0) {
    bench_.testbed.release_lease(now);
    return enter(Stage::settling, now);
  }
  begin_teardown_step(main_steps(), now);
}

void Engine::begin_teardown_step(int index, Utime now) {
  index = pass_gates(index, state_.step_count, now);
  if (index < state_.step_count && !hurry_) return begin_step(index, now);
  bench_.testbed.release_lease(now);
  enter(Stage::settling, now);
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
  begin_teardown_step(state_.current_step + 1, now);
}

/// Truth comes some time after the moment it is true for, and so does the last estimate.
void Engine::settle(Utime now) {
  constexpr Utime min_wait = second;
  constexpr Utime max_wait = 5 * second;
  const Utime waited = now - stage_start_;
  Utime end = 0;
  for (int i = 0; i < main_steps(); ++i) {
    end = std::max(end, state_.steps[static_cast<std::size_t>(i)].utime_end);
  }
  const auto& truth = record_.truth().samples();
  const bool truth_has_come = end == 0 || (!truth.empty() && truth.back().utime >= end);
  if ((waited >= min_wait && truth_has_come) || waited >= max_wait) judge(now);
}

bool Engine::judges_returns() const {
  return std::any_of(procedure_.criteria.begin(), procedure_.criteria.end(),
                     [](const evaluation::Criterion& c) { return c.measurement->of_returns; });
}

void Engine::judge(Utime now) {
  state_.utime = now;
  record_.add(state_);
  verdict_basis_t basis = record_.basis();
  basis.utime = now;
  basis.seq = 1;  // it is judged once
  basis.session = options_.commander.session;
  actions_.send(basis);
  const evaluation::Measurer measurer(record_, nearest_);
  state_.criteria = evaluation::judge(procedure_.criteria, measurer);
  state_.criterion_count = static_cast<std::int32_t>(state_.criteria.size());
  state_.outcome =
      verdict_ == procedure_state_t::NONE ? evaluation::outcome_of(state_.criteria) : verdict_;
  state_.current_step = -1;
  show(procedure_state_t::FINISHED);
  enter(Stage::finished, now);
}

}  // namespace berth::procedures
