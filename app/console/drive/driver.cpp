// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/drive/driver.h"

#include <berth/event_t.hpp>

#include "app/console/drive/arguments.h"
#include "common/core/error.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "procedures/engine/operator_control.h"

namespace berth::console {
namespace {

bool stands(const procedure_state_t& state) { return state.state == procedure_state_t::HELD; }

}  // namespace

struct Driver::Verb {
  void (*obey)(Driver& driver, const Command& command);
  bool needs_control = true;
  bool is_reported = true;  ///< as an event
};

const std::map<std::string, Driver::Verb>& Driver::verbs() {
  using C = procedure_command_t;
  static const std::map<std::string, Verb> table{
      {"take_control", {[](Driver& d, const Command& c) { d.take_control(c); }, false}},
      {"keep_control", {[](Driver& d, const Command& c) { d.keep_control(c); }, true, false}},
      {"release_control", {[](Driver& d, const Command& c) { d.release_control(c); }}},
      {"hold", {[](Driver& d, const Command& c) { d.hold(c); }, false}},
      {"resume", {[](Driver& d, const Command& c) { d.request(c, C::RESUME); }}},
      {"step", {[](Driver& d, const Command& c) { d.request(c, C::STEP); }}},
      {"skip", {[](Driver& d, const Command& c) { d.request(c, C::SKIP, text_in(c, "reason")); }}},
      {"retry", {[](Driver& d, const Command& c) { d.request(c, C::RETRY); }}},
      {"reset", {[](Driver& d, const Command& c) { d.request(c, C::RESET); }}},
      {"abort",
       {[](Driver& d, const Command& c) { d.request(c, C::ABORT, text_in(c, "reason")); }}},
      {"answer", {[](Driver& d, const Command& c) { d.prompt(c); }}},
      {"speed", {[](Driver& d, const Command& c) { d.speed(c); }}},
      {"lamps", {[](Driver& d, const Command& c) { d.lamps(c); }}},
      {"run", {[](Driver& d, const Command& c) { d.run(c); }}},
  };
  return table;
}

Driver::Driver(Bus& bus, Loop& loop, DriverOptions options, DriverHost host)
    : loop_(loop),
      options_(std::move(options)),
      host_(std::move(host)),
      procedure_(bus, loop, options_.session),
      cell_(bus, loop, options_.session),
      lease_(procedures::control_lifetime) {}

// Requests -------------------------------------------------------------------------------------

void Driver::take(const Command& command) {
  const auto verb = verbs().find(command.name);
  if (verb == verbs().end()) return refuse(command, "'" + command.name + "' is not known");
  if (verb->second.is_reported) {
    host_.event(event_t::INFO, "operator-asked",
                name_of(command.viewer) + ": " + command.name +
                    (command.arguments.empty() ? "" : " " + json_text(command.arguments)) +
                    (command.confirm.empty() ? "" : ", for the second time"));
  }
  try {
    if (const std::string why = objection(command, verb->second); !why.empty()) {
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

std::string Driver::objection(const Command& command, const Verb& verb) const {
  if (!verb.needs_control) return {};
  const Control control = this->control();
  if (control.viewer == command.viewer) return {};
  return control.holder.empty() ? "take control first" : control.holder + " has control";
}

/// Of the procedure, for a person who is to say yes.
std::string Driver::what_goes_on() const {
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

std::string Driver::hazard(const Command& command) const {
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
             fixed(100 * requested, 0) + " % of the speed that the procedure asks for";
    }
  }
  return {};
}

// Answers -----------------------------------------------------------------------------------------

void Driver::answer(const Command& command, bool accepted, const std::string& text,
                    const std::string& confirm) {
  host_.answer(command.viewer, {command.id, accepted, text, confirm});
}

void Driver::refuse(const Command& command, const std::string& why) {
  const auto verb = verbs().find(command.name);
  if (verb == verbs().end() || verb->second.is_reported) {
    host_.event(event_t::WARNING, "operator-refused",
                name_of(command.viewer) + ": no " + command.name + ": " + why);
  }
  answer(command, false, why);
}

ProcedureClient::Done Driver::answering(const Command& command) {
  return [this, command](CommandStatus status, const std::string& reason) {
    answer(command, status == CommandStatus::accepted, reason);
  };
}

void Driver::request(const Command& command, std::int8_t what, const std::string& text,
                     const std::string& prompt_id) {
  if (!procedure_.active()) return refuse(command, "no procedure runs");
  procedure_command_t request{};
  request.command = what;
  request.text = text;
  request.prompt_id = prompt_id;
  send(command.viewer, std::move(request), answering(command));
}

void Driver::send(const std::string& viewer, procedure_command_t request,
                  ProcedureClient::Done done) {
  constexpr Utime answer_limit = 2 * second;
  request.commander = name_of(viewer);
  procedure_.send(std::move(request), std::move(done), answer_limit);
}

// Commands ----------------------------------------------------------------------------------------

void Driver::hold(const Command& command) {
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

void Driver::prompt(const Command& command) {
  request(command, procedure_command_t::ANSWER, text_in(command, "text"),
          text_in(command, "prompt_id"));
}

void Driver::speed(const Command& command) {
  const double override = number_in(command, "override");
  const std::string text = fixed(100 * override, 1) + " %";
  procedures::speed_override_of(text);  // complains
  if (procedure_.active()) return request(command, procedure_command_t::SPEED, text);
  cell_.set_speed(override, answering(command));
}

void Driver::lamps(const Command& command) {
  const std::string text = lamps_text(command);
  if (procedure_.active()) return request(command, procedure_command_t::LAMPS, text);
  cell_.set_lamps(text, answering(command));
}

void Driver::run(const Command& command) {
  if (procedure_.active()) {
    return refuse(command, "procedure '" + procedure_.state()->procedure + "' runs");
  }
  RunOrder order;
  order.procedure = text_in(command, "procedure");
  order.parameters = parameters_in(command);
  order.who = name_of(command.viewer);
  const std::string why = host_.run(order);
  if (!why.empty()) return refuse(command, why);
  answer(command, true, "it is checked, and then it starts");
}

}  // namespace berth::console
