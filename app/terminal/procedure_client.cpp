// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/procedure_client.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr Utime answer_limit = 2 * second;
constexpr Utime state_limit = 2 * second;  ///< without a state, after which no engine is there

}  // namespace

std::string ProcedureClient::operator_name() {
  const char* user = std::getenv("USER");
  return std::string(user != nullptr && *user != '\0' ? user : "operator") + " (process " +
         std::to_string(getpid()) + ")";
}

ProcedureClient::ProcedureClient(Bus& bus, Loop& loop, std::int64_t session, std::string name)
    : bus_(bus), loop_(loop), commander_{std::move(name), session, 0} {
  bus.subscribe<command_answers_t>(channels::procedure_answers, Queue::fifo(),
                                   [this](const command_answers_t& answers) {
                                     for (Request& one : requests_) one.client.on(answers);
                                     finish_answered();
                                   });
  bus.subscribe<procedure_state_t>(channels::procedure_state, Queue::fifo(),
                                   [this](const procedure_state_t& state) {
                                     if (state.session != commander_.session) return;
                                     state_ = state;
                                     state_received_ = loop_.now();
                                   });
  bus.subscribe<operator_control_t>(channels::operator_control, Queue::fifo(),
                                    [this](const operator_control_t& control) {
                                      if (control.session == commander_.session) control_ = control;
                                    });
}

ProcedureClient::~ProcedureClient() { loop_.cancel(timer_); }

bool ProcedureClient::active() const {
  return state_ && state_->state != procedure_state_t::FINISHED &&
         loop_.now() - state_received_ <= state_limit;
}

void ProcedureClient::publish(const procedure_command_t& command) {
  bus_.publish(channels::procedure_command, command);
}

void ProcedureClient::send(procedure_command_t command, Done done) {
  const bool stops =
      command.command == procedure_command_t::HOLD || command.command == procedure_command_t::ABORT;
  send(std::move(command), std::move(done), stops ? 0 : answer_limit);
}

void ProcedureClient::send(procedure_command_t command, Done done, Utime time_limit) {
  Commander commander = as(command.commander);
  auto& request = requests_.emplace_back(Request{
      CommandClient<procedure_command_t>([this](const procedure_command_t& c) { publish(c); }),
      std::move(done)});
  request.client.send(std::move(command), commander, loop_.now(), time_limit);
  if (timer_ == 0) timer_ = loop_.every(50 * millisecond, [this] { tick(); });
}

void ProcedureClient::keep_control(const std::string& holder) {
  procedure_command_t command{};
  command.command = procedure_command_t::KEEP_CONTROL;
  Commander commander = as(holder);
  complete(command, commander, loop_.now());
  publish(command);
}

/// One numbering for all of them.
Commander ProcedureClient::as(const std::string& name) {
  Commander commander = commander_;
  ++commander_.last_seq;
  if (!name.empty()) commander.name = name;
  return commander;
}

void ProcedureClient::tick() {
  const bool finished = state_ && state_->state == procedure_state_t::FINISHED;
  const bool gone = finished && loop_.now() - state_received_ > state_limit;
  for (Request& one : requests_) {
    one.client.tick(loop_.now());
    if (gone && one.client.pending()) one.client.give_up("the procedure has finished");
  }
  finish_answered();
}

void ProcedureClient::finish_answered() {
  const auto answered = [this] {
    return std::find_if(requests_.begin(), requests_.end(),
                        [](const Request& one) { return !one.client.pending(); });
  };
  for (auto one = answered(); one != requests_.end(); one = answered()) {
    const Request ended = std::move(*one);
    requests_.erase(one);
    if (ended.done) ended.done(ended.client.status(), ended.client.reason());  // may send again
  }
  if (requests_.empty() && timer_ != 0) loop_.cancel(std::exchange(timer_, 0));
}

}  // namespace berth
