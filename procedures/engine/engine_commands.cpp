// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <berth/event_t.hpp>

#include "common/core/error.h"
#include "common/core/text.h"
#include "procedures/engine/engine.h"
#include "procedures/engine/operator_control.h"

namespace berth::procedures {
namespace {

using Command = procedure_command_t;

/// Empty: not known.
std::string name_of(std::int8_t command) {
  switch (command) {
    case Command::ABORT:
      return "abort";
    case Command::HOLD:
      return "hold";
    case Command::RESUME:
      return "resume";
    case Command::STEP:
      return "step";
    case Command::SKIP:
      return "skip";
    case Command::RETRY:
      return "retry";
    case Command::RESET:
      return "reset";
    case Command::ANSWER:
      return "answer";
    case Command::TAKE_CONTROL:
      return "take control";
    case Command::RELEASE_CONTROL:
      return "release control";
    case Command::SPEED:
      return "speed";
    case Command::LAMPS:
      return "lamps";
    default:
      return {};
  }
}

}  // namespace

std::string Engine::obey(const procedure_command_t& message, Utime now) {
  const bool stops = message.command == Command::HOLD || message.command == Command::ABORT;
  const std::int64_t session = options_.commander.session;
  if (message.session != session && !stops) {
    return "it belongs to session " + std::to_string(message.session) + ", this procedure to " +
           std::to_string(session);
  }
  if (message.utime_expires < now && !stops) {
    return "it came " + fixed(seconds(now - message.utime_expires), 1) + " s too late";
  }
  if (message.command == Command::KEEP_CONTROL) {  // twice a second: no event
    return control_.keep(message.commander, now) ? "" : "it has no control";
  }
  if (finished()) return "the procedure has finished";
  const std::string name = name_of(message.command);
  const auto refused = [&](const std::string& why) {
    const std::string what = name.empty() ? "command " + std::to_string(message.command) : name;
    if (!why.empty())
      actions_.event(event_t::WARNING, "command-refused", "no " + what + ": " + why);
    return why;
  };
  if (name.empty()) return refused("it is not known");
  bench_.live.set_time(now);
  actions_.event(
      event_t::NOTICE, "operator-command",
      message.commander + ": " + name + (message.text.empty() ? "" : ": " + message.text));
  const std::string unusual = stops ? unusual_stop(message, session, now, false) : "";
  if (!unusual.empty()) {
    actions_.event(event_t::WARNING, "unusual-stop",
                   name + " of '" + message.commander + "' is obeyed, although it " + unusual);
  }
  watch_control(now);
  const std::string reason_to_refuse = control_.reason_to_refuse(message, now);
  return refused(reason_to_refuse.empty() ? carry_out(message, now) : reason_to_refuse);
}

std::string Engine::carry_out(const procedure_command_t& message, Utime now) {
  switch (message.command) {
    case procedure_command_t::ABORT:
      abort(message.text.empty() ? "aborted by " + message.commander : message.text, now);
      return "";
    case procedure_command_t::HOLD:
      return request_hold(message.commander, now);
    case procedure_command_t::RESUME:
      return request_resume(false, now);
    case procedure_command_t::STEP:
      return request_step(now);
    case procedure_command_t::SKIP:
      return request_skip(message.text, now);
    case procedure_command_t::RETRY:
      return request_retry(now);
    case procedure_command_t::RESET:
      return request_reset(now);
    case procedure_command_t::ANSWER:
      return request_answer(message, now);
    case procedure_command_t::SPEED:
      return request_speed(message.text, now);
    case procedure_command_t::LAMPS:
      return request_lamps(message.text, now);
    case procedure_command_t::TAKE_CONTROL:
      return request_take_control(message, now);
    default:
      return request_release_control(message.commander, now);
  }
}

void Engine::abort(const std::string& reason, Utime now) {
  if (in_preparation() || in_steps()) {
    conclude(procedure_state_t::ABORTED, reason, now);
    return;
  }
  hurry_ = true;
  // A motion of the teardown is stopped when its step ends early.
  if (stage_ == Stage::teardown) bench_.testbed.order(testbed_command2_t::STOP, now);
}

void Engine::hold(Hold how, const std::string& reason, Utime now) {
  hold_ = how;
  held_since_ = now;
  rest_.begin();
  if (how == Hold::in_step) bench_.testbed.order(testbed_command2_t::HOLD, now);
  state_.reason = reason;
  show(procedure_state_t::HELD);
}

std::string Engine::request_hold(const std::string& holder, Utime now) {
  const std::string reason = "held by " + holder;
  if (held()) return "it is held already";
  if (stage_ == Stage::settling) return "nothing moves any more";
  if (stage_ == Stage::running) {
    hold(Hold::in_step, reason, now);
  } else if (in_preparation() || in_steps()) {
    hold_requested_ = reason;  // before a step does anything
  } else {
    abort(reason, now);  // the rest of the teardown is skipped
  }
  return "";
}

std::string Engine::unmet_to_go_on(Utime now) {
  bench_.live.set_time(now);
  return look_at_preconditions(true);
}

void Engine::end_hold(Utime now) {
  if (hold_ == Hold::in_step) held_total_ += now - held_since_;
  hold_ = Hold::none;
  alarm_.clear();
  resumed_ = counted_until_ = now;
  state_.reason.clear();
  show(procedure_state_t::RUNNING);
}

std::string Engine::request_resume(bool one_step, Utime now) {
  if (stage_ != Stage::running || !held()) {
    const bool was_requested = hold_after_step_ || !hold_requested_.empty();
    hold_after_step_ = false;
    hold_requested_.clear();
    return was_requested ? "" : "nothing is held";
  }
  if (hold_ == Hold::failed) {
    return "step '" + current().name + "' has failed: retry, skip or abort";
  }
  if (const std::string unmet = unmet_to_go_on(now); !unmet.empty()) return unmet;
  hold_after_step_ = one_step;
  const bool between = hold_ == Hold::between;
  end_hold(now);
  if (between) {
    begin_step(state_.current_step + 1, now);
    return "";
  }
  // Steps without a motion were held by the engine alone.
  if (bench_.testbed.state()->state != testbed_state_t::IDLE) {
    bench_.testbed.order(testbed_command2_t::RESUME, now);
  }
  show_prompt(now);
  return "";
}

std::string Engine::request_step(Utime now) {
  if (stage_ != Stage::running || held()) return request_resume(true, now);
  hold_after_step_ = true;
  return "";
}

std::string Engine::request_skip(const std::string& reason, Utime now) {
  if (stage_ != Stage::running) return "no step is running";
  if (reason.empty()) return "a reason is needed, for the record";
  if (const std::string unmet = held() ? unmet_to_go_on(now) : ""; !unmet.empty()) return unmet;
  const Hold was = hold_;
  if (held()) end_hold(now);
  if (was == Hold::between) ++state_.current_step;
  actions_.event(event_t::NOTICE, "step-skipped",
                 "step '" + current().name + "' skipped: " + reason);
  if (was == Hold::between) {
    // It never began; the operator goes on step by step.
    current().state = procedure_step_t::SKIPPED;
    current().detail = reason;
    hold_after_step_ = true;
  } else {
    const std::string failure = was == Hold::failed ? " (" + current().detail + ")" : "";
    end_step(procedure_step_t::SKIPPED, reason + failure, now);
  }
  show_prompt(now);
  stop_and_begin(state_.current_step + 1, now);
  return "";
}

std::string Engine::request_retry(Utime now) {
  if (stage_ != Stage::running) return "no step is running";
  if (const std::string unmet = held() ? unmet_to_go_on(now) : ""; !unmet.empty()) return unmet;
  if (held()) end_hold(now);
  if (current().state == procedure_step_t::RUNNING) {
    end_step(procedure_step_t::ABORTED, "tried again", now);
    show_prompt(now);
  }
  stop_and_begin(state_.current_step, now);
  return "";
}

std::string Engine::request_reset(Utime now) {
  if (!held()) return "nothing is held";
  const auto& facility = bench_.live.facility;
  const bool open = facility && !(facility->valid && facility->estop_chain_closed &&
                                  facility->fence_closed && facility->motion_enabled);
  const testbed_state_t& testbed = *bench_.testbed.state();
  if (open) return "put it right first: " + testbed.reason;
  bench_.testbed.order(testbed_command2_t::RESET, now);
  return "";
}

std::string Engine::request_answer(const procedure_command_t& message, Utime now) {
  if (state_.prompt_id.empty()) return "no prompt is open";
  if (message.prompt_id != state_.prompt_id) {
    return "prompt " + message.prompt_id + " is not open, but prompt " + state_.prompt_id;
  }
  if (message.text.empty()) return "it is empty";
  const auto& choices = state_.choices;
  if (!choices.empty() &&
      std::find(choices.begin(), choices.end(), message.text) == choices.end()) {
    return "found '" + message.text + "', expected one of: " + joined(choices);
  }
  runner_->answer(message.text, message.commander);
  show_prompt(now);
  return "";
}

std::string Engine::request_speed(const std::string& text, Utime now) try {
  bench_.testbed.set_override(speed_override_of(text), now);
  return "";
} catch (const InputError& e) {
  return e.what();
}

std::string Engine::request_lamps(const std::string& text, Utime now) try {
  const auto& facility = bench_.facility.state();
  if (!facility || facility->valid == 0) return "the facility does not answer";
  bench_.facility.command(lamps_of(text, *facility), now);
  return "";
} catch (const InputError& e) {
  return e.what();
}

// Control -----------------------------------------------------------------------------------------

std::string Engine::request_take_control(const procedure_command_t& message, Utime now) {
  const std::string change = control_.take(message, now);
  hold_due_.clear();
  ++revision_;
  if (!change.empty()) actions_.event(event_t::NOTICE, "control-taken", change);
  return "";
}

std::string Engine::request_release_control(const std::string& commander, Utime now) {
  if (!control_.release(commander, now)) return commander + " does not have it";
  ++revision_;
  actions_.event(event_t::NOTICE, "control-released", "no operator has control");
  return "";
}

void Engine::watch_control(Utime now) {
  const bool holds = control_.holds_when_lost();
  const std::string lost = control_.lapse(now);
  if (!lost.empty()) {
    ++revision_;
    actions_.event(event_t::WARNING, "control-lapsed",
                   "control of " + lost + " lapsed: no operator has control");
    if (holds) hold_due_ = "control of " + lost + " lapsed";
  }
  hold_when_due(now);
}

/// Before the first step and between two, the hold begins with the next step.
void Engine::hold_when_due(Utime now) {
  const std::string reason = hold_requested_.empty() ? hold_due_ : hold_requested_;
  if (reason.empty() || stage_ != Stage::running) return;
  if (!held()) hold(Hold::in_step, reason, now);
  hold_requested_.clear();
  hold_due_.clear();
}

}  // namespace berth::procedures
