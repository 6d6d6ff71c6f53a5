// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <berth/command_answers_t.hpp>
#include <berth/estimator_command_t.hpp>
#include <berth/estimator_state_t.hpp>
#include <berth/injection_state_t.hpp>
#include <berth/injection_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <functional>
#include <string>

#include "common/bus/loop.h"
#include "common/core/seen_commands.h"
#include "common/core/text.h"

/// Commands to a node, and what its state says of them.
namespace berth {

/// Who commands, and in which run.
struct Commander {
  std::string name;
  std::int64_t session = 0;
  /// Commands are numbered above this: above all that this commander sent before in the session.
  std::int64_t last_seq = 0;
};

/// How long a command is good after it was last sent.
inline constexpr Utime command_lifetime = 2 * second;

/// Fills in a new command: who sends it, its number, and the time until which it is good.
template <class Command>
void complete(Command& command, Commander& commander, Utime now) {
  command.utime = now;
  command.seq = ++commander.last_seq;
  command.session = commander.session;
  command.commander = commander.name;
  if constexpr (requires { command.utime_expires; }) command.utime_expires = now + command_lifetime;
}

/// How often a command is repeated until it is answered. One that stops must not cost the arms' way
/// of half a second, and a person waits for the answer to an operator's.
template <class Command>
Utime repeat_period_of(const Command&) {
  return 500 * millisecond;
}
inline Utime repeat_period_of(const procedure_command_t&) { return 100 * millisecond; }
inline Utime repeat_period_of(const testbed_command2_t& command) {
  const bool stops =
      command.command == testbed_command2_t::HOLD || command.command == testbed_command2_t::STOP;
  return (stops ? 100 : 500) * millisecond;
}

/// Where a command is on its way. unanswered: given up.
enum class CommandStatus { none, pending, accepted, refused, finished, unanswered };

/// What a node's message says of a command; none: nothing.
struct CommandReply {
  CommandStatus status = CommandStatus::none;
  std::string reason;  ///< of a refusal
};

inline CommandReply reply_to(const testbed_command2_t& command, const testbed_state_t& state) {
  if (state.refused_seq == command.seq) return {CommandStatus::refused, state.refusal};
  if (state.finished_seq == command.seq) return {CommandStatus::finished, ""};
  if (state.command_seq == command.seq) return {CommandStatus::accepted, ""};
  return {};
}

inline CommandReply reply_to(const estimator_command_t& command, const estimator_state_t& state) {
  if (state.refused_seq == command.seq) return {CommandStatus::refused, state.reason};
  if (state.command_seq == command.seq) return {CommandStatus::accepted, ""};
  return {};
}

inline CommandReply reply_to(const injection_t& command, const injection_state_t& state) {
  if (state.refused_seq == command.seq) return {CommandStatus::refused, state.refusal};
  if (state.accepted_seq == command.seq) return {CommandStatus::accepted, ""};
  return {};
}

template <class Command>
CommandReply reply_to(const Command& command, const command_answers_t& state) {
  const auto ours =
      std::find_if(state.answers.begin(), state.answers.end(),
                   [&](const command_answer_t& answer) { return same_command(answer, command); });
  if (ours == state.answers.end()) return {};
  const bool accepted = ours->answer == command_answer_t::ACCEPTED;
  return {accepted ? CommandStatus::accepted : CommandStatus::refused, ours->reason};
}

/// Sends one command at a time to a node, repeats it until the node answers it, and knows the
/// answer: accepted, refused or finished. Called from one loop.
template <class Command>
class CommandClient {
 public:
  using Publish = std::function<void(const Command&)>;
  explicit CommandClient(Publish publish) : publish_(std::move(publish)) {}

  /// As a new command of this commander; the one before is no longer repeated.
  /// @param time_limit us, after which it is given up without an answer; 0: never
  void send(Command command, Commander& commander, Utime now, Utime time_limit = 0) {
    command_ = std::move(command);
    complete(command_, commander, now);
    status_ = CommandStatus::pending;
    reason_.clear();
    time_limit_ = time_limit;
    sent_ = now;
    publish_(command_);
  }

  /// A message of the node that answers. @return whether it says something new of the command.
  template <class State>
  bool on(const State& state) {
    if (status_ != CommandStatus::pending && status_ != CommandStatus::accepted) return false;
    CommandReply reply = reply_to(command_, state);
    if (reply.status == CommandStatus::none || reply.status == status_) return false;
    status_ = reply.status;
    reason_ = std::move(reply.reason);
    return true;
  }

  /// Repeats what has no answer. At 20 Hz or more.
  void tick(Utime now) {
    if (!pending()) return;
    if (time_limit_ > 0 && now - command_.utime >= time_limit_) {
      return give_up("no answer within " + fixed(seconds(time_limit_), 1) + " s");
    }
    if (now - sent_ < repeat_period_of(command_)) return;
    if constexpr (requires { command_.utime_expires; }) {
      command_.utime_expires = now + command_lifetime;
    }
    sent_ = now;
    publish_(command_);
  }

  void give_up(const std::string& why) {
    status_ = CommandStatus::unanswered;
    reason_ = why;
  }

  CommandStatus status() const { return status_; }
  bool pending() const { return status_ == CommandStatus::pending; }
  /// Why it was refused, or given up: the node's own words.
  const std::string& reason() const { return reason_; }
  /// What is sent; the sender may change what a repetition asks for.
  Command& command() { return command_; }
  const Command& command() const { return command_; }

 private:
  Publish publish_;
  Command command_{};
  CommandStatus status_ = CommandStatus::none;
  std::string reason_;
  Utime time_limit_ = 0;
  Utime sent_ = 0;
};

}  // namespace berth
