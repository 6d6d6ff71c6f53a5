// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/control/command_handler.h"

#include <berth/event_t.hpp>
#include <utility>

#include "app/console/control/page_command.h"
#include "common/core/error.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "procedures/engine/operator_control.h"

namespace berth::console {
namespace {

bool stands(const procedure_state_t& state) { return state.state == procedure_state_t::HELD; }

}  // namespace

struct CommandHandler::Verb {
  void (*obey)(CommandHandler& handler, const Command& command);
  bool needs_control = true;
  bool is_reported = true;  ///< as an event
};

const std::map<std::string, CommandHandler::Verb>& CommandHandler::verbs() {
  using C = procedure_command_t;
  static const std::map<std::string, Verb> table{
      {"take_control", {[](CommandHandler& h, const Command& c) { h.take_control(c); }, false}},
      {"keep_control",
       {[](CommandHandler& h, const Command& c) { h.keep_control(c); }, true, false}},
      {"release_control", {[](CommandHandler& h, const Command& c) { h.release_control(c); }}},
      {"hold", {[](CommandHandler& h, const Command& c) { h.hold(c); }, false}},
      {"resume", {[](CommandHandler& h, const Command& c) { h.request(c, C::RESUME); }}},
      {"step", {[](CommandHandler& h, const Command& c) { h.request(c, C::STEP); }}},
      {"skip",
       {[](CommandHandler& h, const Command& c) { h.request(c, C::SKIP, text_in(c, "reason")); }}},
      {"retry", {[](CommandHandler& h, const Command& c) { h.request(c, C::RETRY); }}},
      {"reset", {[](CommandHandler& h, const Command& c) { h.request(c, C::RESET); }}},
      {"abort",
       {[](CommandHandler& h, const Command& c) { h.request(c, C::ABORT, text_in(c, "reason")); }}},
      {"answer", {[](CommandHandler& h, const Command& c) { h.prompt(c); }}},
      {"speed", {[](CommandHandler& h, const Command& c) { h.speed(c); }}},
      {"lamps", {[](CommandHandler& h, const Command& c) { h.lamps(c); }}},
      {"run", {[](CommandHandler& h, const Command& c) { h.run(c); }}},
  };
  return table;
}

CommandHandler::CommandHandler(Bus& bus, Loop& loop, CommandHandlerOptions options,
                               CommandHandlerHost host)
    : loop_(loop),
      options_(std::move(options)),
      host_(std::move(host)),
      procedure_(bus, loop, options_.session),
      cell_(bus, loop, options_.session),
      lease_(procedures::control_lifetime) {}

// Requests -------------------------------------------------------------------------------------

void CommandHandler::take(const Command& command) {
  const auto verb = verbs().find(command.name);
  if (verb == verbs().end()) return refuse(command, "'" + command.name + "' is not known");
  if (verb->second.is_reported) {
    host_.event(event_t::INFO, "operator-asked",
                name_of(command.viewer) + ": " + command.name +
                    (command.arguments.empty() ? "" : " " + json_text(command.arguments)) +
                    (command.confirm.empty() ? "" : ", for the second time"));
  }
  try {
    if (const std::string why = reason_to_refuse(command, verb->second); !why.empty()) {
      return refuse(command, why);
    }
    const std::string hazard = this->hazard(command);
    if (!hazard.empty() && !confirmations_.given(command, loop_.now())) {
      return answer(command, false, hazard, confirmations_.request(command, loop_.now()));
    }
    verb->second.obey(*this, command);
  } catch (const InputError& e) {
    refuse(command, e.what());
  }
}

std::string CommandHandler::reason_to_refuse(const Command& command, const Verb& verb) const {
  if (!verb.needs_control) return {};
  const Control control = this->control();
  if (control.viewer == command.viewer) return {};
  return control.holder.empty() ? "take control first" : control.holder + " has control";
}

/// The procedure under way, for the person who is to confirm.
std::string CommandHandler::what_goes_on() const {
  const auto& state = procedure_.state();
  const auto& testbed = cell_.testbed();
  std::string text = "the arms may move";
  if (testbed) text += " at " + fixed(100 * testbed->speed_override, 0) + " % of their speed";
  if (!state || state->current_step < 0) return text;
  const auto index = static_cast<std::size_t>(state->current_step);
  if (index >= state->steps.size()) return text;
  return text + ": " + state->procedure + ", step " + std::to_string(index + 1) + " of " +
         std::to_string(state->step_count) + ", '" + state->steps[index].name + "'" +
         (state->steps[index].detail.empty() ? "" : " (" + state->steps[index].detail + ")");
}

std::string CommandHandler::hazard(const Command& command) const {
  const Control control = this->control();
  if (command.name == "take_control") {
    if (control.holder.empty() || control.viewer == command.viewer) return {};
    if (!procedure_.active() && control.viewer.empty()) return {};  // is refused
    return control.holder + " has control and would lose it to you";
  }
  if (command.name == "run") {
    return "the arms may move: " + text_in(command, "procedure") + " begins";
  }
  if (!procedure_.active()) return {};
  if (command.name == "resume") return "it goes on: " + what_goes_on();
  if (command.name == "step" && stands(*procedure_.state())) {
    return "it goes on and holds after this step: " + what_goes_on();
  }
  if (command.name == "skip") {
    return "this step is left out and the next one begins: " + what_goes_on();
  }
  if (command.name == "retry") return "the step begins anew: " + what_goes_on();
  if (command.name == "speed" && cell_.testbed()) {
    constexpr double same = 0.005;
    const double requested = number_in(command, "override");
    const double now = cell_.testbed()->speed_override;
    if (requested > now + same) {
      return "the arms become faster: from " + fixed(100 * now, 0) + " % to " +
             fixed(100 * requested, 0) + " % of the speed that the procedure requests";
    }
  }
  return {};
}

// Answers -----------------------------------------------------------------------------------------

void CommandHandler::answer(const Command& command, bool accepted, const std::string& text,
                            const std::string& confirm) {
  host_.answer(command.viewer, {command.id, accepted, text, confirm});
}

void CommandHandler::refuse(const Command& command, const std::string& why) {
  const auto verb = verbs().find(command.name);
  if (verb == verbs().end() || verb->second.is_reported) {
    host_.event(event_t::WARNING, "operator-refused",
                name_of(command.viewer) + ": no " + command.name + ": " + why);
  }
  answer(command, false, why);
}

ProcedureClient::Done CommandHandler::answering(const Command& command) {
  return [this, command](CommandStatus status, const std::string& reason) {
    answer(command, status == CommandStatus::accepted, reason);
  };
}

void CommandHandler::request(const Command& command, std::int8_t what, const std::string& text,
                             const std::string& prompt_id) {
  if (!procedure_.active()) return refuse(command, "no procedure runs");
  procedure_command_t request{};
  request.command = what;
  request.text = text;
  request.prompt_id = prompt_id;
  send(command.viewer, std::move(request), answering(command));
}

void CommandHandler::send(const std::string& viewer, procedure_command_t request,
                          ProcedureClient::Done done) {
  constexpr Utime answer_limit = 2 * second;
  request.commander = name_of(viewer);
  procedure_.send(std::move(request), std::move(done), answer_limit);
}

// Commands ----------------------------------------------------------------------------------------

void CommandHandler::hold(const Command& command) {
  const auto hold_cell = [this, command](const std::string& why) {
    cell_.hold(name_of(command.viewer), [this, command, why](CommandStatus status,
                                                             const std::string& reason) {
      const bool accepted = status == CommandStatus::accepted;
      answer(command, accepted,
             why + (accepted ? "; the testbed holds" : "; HOLD is repeated, but " + reason));
    });
  };
  if (!procedure_.active()) return hold_cell("no procedure runs");
  procedure_command_t request{};
  request.command = procedure_command_t::HOLD;
  send(command.viewer, request,
       [hold_cell, done = answering(command)](CommandStatus status, const std::string& reason) {
         if (status != CommandStatus::unanswered) return done(status, reason);
         hold_cell("the procedure does not answer");
       });
}

void CommandHandler::prompt(const Command& command) {
  request(command, procedure_command_t::ANSWER, text_in(command, "text"),
          text_in(command, "prompt_id"));
}

void CommandHandler::speed(const Command& command) {
  const double override = number_in(command, "override");
  const std::string text = fixed(100 * override, 1) + " %";
  procedures::speed_override_of(text);  // complains
  if (procedure_.active()) return request(command, procedure_command_t::SPEED, text);
  cell_.set_speed(override, answering(command));
}

void CommandHandler::lamps(const Command& command) {
  const std::string text = lamps_text(command);
  if (procedure_.active()) return request(command, procedure_command_t::LAMPS, text);
  cell_.set_lamps(text, answering(command));
}

void CommandHandler::run(const Command& command) {
  if (procedure_.active()) {
    return refuse(command, "procedure '" + procedure_.state()->procedure + "' runs");
  }
  RunOrder order;
  order.procedure = text_in(command, "procedure");
  order.parameters = parameters_in(command);
  order.operator_name = name_of(command.viewer);
  const std::string why = host_.run(order);
  if (!why.empty()) return refuse(command, why);
  answer(command, true, "it is checked, and then it starts");
}

}  // namespace berth::console

// Who of the viewers has control: the engine publishes it while a procedure runs, else the
// testbed's lease does. A viewer that is still there keeps it from one to the other.

namespace berth::console {
namespace {

constexpr Utime request_again = second;
constexpr Utime time_for_lease = 3 * second;

/// Gives the lease to a viewer, in place of its former holder.
void hand_over(Lease& lease, const std::string& viewer, Utime now) {
  if (!lease.held_by(viewer, now)) lease.release(lease.holder(), now);
  lease.take(viewer, now);
}

}  // namespace

CommandHandler::Control CommandHandler::control() const {
  const Utime now = loop_.now();
  const operator_control_t engine = procedure_.control();
  const bool runs = procedure_.active();
  const std::string ours = options_.name + " ";
  if (runs && !engine.holder.empty()) {
    const bool is_ours = engine.holder.rfind(ours, 0) == 0;
    return {engine.holder, is_ours ? engine.holder.substr(ours.size()) : "", engine.utime_expires,
            engine.holds_when_lost != 0};
  }
  if (lease_.held(now)) return {name_of(lease_.holder()), lease_.holder(), lease_.expires(), false};
  const std::string holder = cell_.lease_holder();
  if (runs || holder.rfind(ours, 0) == 0) return {};
  return {holder, "", cell_.testbed() && !holder.empty() ? cell_.testbed()->lease_utime_expires : 0,
          false};
}

void CommandHandler::take_control(const Command& command) {
  const Control before = control();
  if (before.viewer == command.viewer) return answer(command, true, "you have control");
  if (procedure_.active()) return take_engine(command.viewer, answering(command));
  if (!before.holder.empty() && before.viewer.empty()) {
    return refuse(command, before.holder + " commands the testbed");
  }
  hand_over(lease_, command.viewer, loop_.now());
  host_.event(event_t::NOTICE, "control-taken",
              name_of(command.viewer) + (before.holder.empty()
                                             ? " has control"
                                             : " has taken control over from " + before.holder));
  follow_testbed();
  answer(command, true, "");
}

void CommandHandler::take_engine(const std::string& viewer, ProcedureClient::Done done) {
  const std::string holder = procedure_.control().holder;
  procedure_command_t request{};
  request.command = procedure_command_t::TAKE_CONTROL;
  if (!holder.empty()) request.text = procedures::take_over_word;
  if (options_.hold_when_lost) {
    request.text +=
        (request.text.empty() ? "" : ", ") + std::string(procedures::hold_when_lost_word);
  }
  engine_requested_ = loop_.now();
  send(viewer, request,
       [this, viewer, done = std::move(done)](CommandStatus status, const std::string& reason) {
         if (status == CommandStatus::accepted) hand_over(lease_, viewer, loop_.now());
         if (done) done(status, reason);
       });
}

void CommandHandler::keep_control(const Command& command) {
  hand_over(lease_, command.viewer, loop_.now());
  if (procedure_.active()) procedure_.keep_control(name_of(command.viewer));
  answer(command, true, "");
}

void CommandHandler::release_control(const Command& command) {
  lease_.release(command.viewer, loop_.now());
  if (procedure_.active() && !procedure_.control().holder.empty()) {
    return request(command, procedure_command_t::RELEASE_CONTROL);
  }
  cell_.give_back();
  host_.event(event_t::NOTICE, "control-released", "no operator has control");
  answer(command, true, "");
}

void CommandHandler::tick() {
  cell_.tick();
  if (procedure_.active()) {
    follow_engine();
  } else {
    follow_testbed();
  }
}

/// The engine needs the testbed's lease, and notices the loss of its operator itself. The holder of
/// the cell's control has that of the procedure that begins.
void CommandHandler::follow_engine() {
  const Utime now = loop_.now();
  cell_.give_back();
  lease_.lapse(now);
  if (!std::exchange(follows_engine_, true)) inherits_ = true;
  const std::string holder = procedure_.control().holder;
  inherits_ = inherits_ && holder.empty() && lease_.held(now);
  if (!lease_.held(now) || holder == name_of(lease_.holder())) return;
  if (!inherits_) {
    lease_.release(lease_.holder(), now);
  } else if (now - engine_requested_ >= request_again) {
    take_engine(lease_.holder(), {});
  }
}

void CommandHandler::follow_testbed() {
  const Utime now = loop_.now();
  follows_engine_ = false;
  const std::string lost = lease_.holder();
  if (lease_.lapse(now)) {
    host_.event(event_t::WARNING, "control-lapsed",
                "control of " + name_of(lost) + " lapsed: no operator has control");
  }
  if (!lease_.held(now)) return cell_.give_back();
  const std::string name = name_of(lease_.holder());
  if (cell_.taken_for() != name) {
    cell_.take(name);
    lease_requested_ = now;
  } else if (!cell_.has_lease() && now - lease_requested_ > time_for_lease) {
    const std::string other = cell_.lease_holder();
    host_.event(
        event_t::WARNING, "control-lapsed",
        name + " has no control: " +
            (other.empty() ? "the testbed gives no lease" : other + " commands the testbed"));
    lease_.release(lease_.holder(), now);
    cell_.give_back();
  }
}

}  // namespace berth::console
