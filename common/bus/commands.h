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
#include <compare>
#include <cstdint>
#include <deque>
#include <functional>
#include <set>
#include <string>
#include <utility>

#include "common/bus/bus.h"
#include "common/bus/loop.h"
#include "common/core/text.h"

namespace berth {

/// Whether two messages carry the same command: equal commander, session, time and number, as in
/// repetitions of a command.
template <class A, class B>
bool same_command(const A& a, const B& b) {
  return a.seq == b.seq && a.utime == b.utime && a.session == b.session &&
         a.commander == b.commander;
}

/// The identities of the commands that a node has received: distinguishes repetitions from new
/// commands.
class SeenCommands {
 public:
  struct Name {
    std::string commander;
    std::int64_t session = 0;
    std::int64_t utime = 0;  ///< us, the same in every repetition
    std::int64_t seq = 0;
    auto operator<=>(const Name&) const = default;
  };
  /// @return false for a repetition.
  bool add(Name name) { return names_.insert(std::move(name)).second; }
  /// The same, of a message that names its commander.
  template <class Command>
  bool add(const Command& command) {
    return add(Name{command.commander, command.session, command.utime, command.seq});
  }

 private:
  std::set<Name> names_;
};

/// Stops (HOLD, STOP, ABORT) of any sender are obeyed: of any session, however late, in any order.
/// @return what is irregular about a stop, to follow "is obeyed, although it"; empty: nothing.
/// @param now us
/// @param overtaken a later command of the same sender has come before it
template <class Message>
std::string unusual_stop(const Message& stop, std::int64_t session, std::int64_t now,
                         bool overtaken) {
  std::string words;
  const auto add = [&words](const std::string& more) {
    words += (words.empty() ? "" : " and ") + more;
  };
  if (stop.session != session) add("belongs to session " + std::to_string(stop.session));
  if (now > stop.utime_expires) {
    add("expired " + std::to_string((now - stop.utime_expires) / 1000) + " ms ago");
  }
  if (overtaken && stop.session == session) add("comes behind a later command");
  return words;
}

}  // namespace berth

/// Commands to a node, and their acknowledgement in its state.
namespace berth {

/// Who commands, and in which run.
struct Commander {
  std::string name;
  std::int64_t session = 0;
  /// Numbers of new commands are above this, the highest that this commander has used in the
  /// session.
  std::int64_t last_seq = 0;
};

/// Lifetime of a command after it was last sent.
inline constexpr Utime command_lifetime = 2 * second;

/// Fills in a new command: commander, number, and time of expiry.
template <class Command>
void complete(Command& command, Commander& commander, Utime now) {
  command.utime = now;
  command.seq = ++commander.last_seq;
  command.session = commander.session;
  command.commander = commander.name;
  if constexpr (requires { command.utime_expires; }) command.utime_expires = now + command_lifetime;
}

/// Period at which a command is repeated until it is answered. Short for stops, which must not be
/// half a second late, and for an operator's commands, whose answer a person awaits.
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

/// Progress of a command. unanswered: given up.
enum class CommandStatus { none, pending, accepted, refused, finished, unanswered };

/// The outcome of a command by a node's message; none: not answered yet.
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

/// Sends one command at a time to a node, repeats it until the node answers it, and keeps the
/// answer: accepted, refused or finished. Called from one loop.
template <class Command>
class CommandClient {
 public:
  using Publish = std::function<void(const Command&)>;
  explicit CommandClient(Publish publish) : publish_(std::move(publish)) {}

  /// Sends a new command of this commander; the previous one is no longer repeated.
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

  /// A message of the node that answers. @return whether the command's outcome has changed.
  template <class State>
  bool on(const State& state) {
    if (status_ != CommandStatus::pending && status_ != CommandStatus::accepted) return false;
    CommandReply reply = reply_to(command_, state);
    if (reply.status == CommandStatus::none || reply.status == status_) return false;
    status_ = reply.status;
    reason_ = std::move(reply.reason);
    return true;
  }

  /// Repeats a command without an answer. Call at 20 Hz or more.
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
  /// Why the command was refused (the node's text), or given up.
  const std::string& reason() const { return reason_; }
  /// The command as sent; the sender may change the content of later repetitions.
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

/// A node's answers to its commands, published as command_answers_t: accepted, or refused with the
/// reason. A repetition is answered again and not obeyed again, for the case that the first answer
/// was lost. Remembers the last 1000 commands.
class CommandAnswers {
 public:
  /// @param channel written by this node alone
  /// @param session of the run
  CommandAnswers(Bus& bus, Loop& loop, std::string channel, std::int64_t session);
  ~CommandAnswers();
  CommandAnswers(const CommandAnswers&) = delete;
  CommandAnswers& operator=(const CommandAnswers&) = delete;

  /// @return false for a repetition: it was answered again, or its answer is still to come.
  template <class Command>
  bool is_new(const Command& command) {
    return add(named(command));
  }
  template <class Command>
  void accept(const Command& command) {
    command_answer_t answer = named(command);
    answer.answer = command_answer_t::ACCEPTED;
    put(answer);
  }
  /// @param reason what was found and expected, for the commander
  template <class Command>
  void refuse(const Command& command, const std::string& reason) {
    command_answer_t answer = named(command);
    answer.answer = command_answer_t::REFUSED;
    answer.reason = reason;
    put(answer);
  }
  /// Forgets a command that could not be carried out: its repetition counts as a new command.
  template <class Command>
  void forget(const Command& command) {
    take(named(command));
  }

 private:
  struct Remembered {
    command_answer_t answer;
    bool given = false;
    Utime last_received = 0;
  };

  template <class Command>
  static command_answer_t named(const Command& command) {
    command_answer_t answer{};
    answer.commander = command.commander;
    answer.session = command.session;
    answer.utime = command.utime;
    answer.seq = command.seq;
    return answer;
  }
  bool add(const command_answer_t& named);
  void put(command_answer_t answer);
  /// Removed from the list; a new entry where it was not in it.
  Remembered take(const command_answer_t& named);
  command_answers_t current() const;
  void publish();

  Bus& bus_;
  Loop& loop_;
  std::string channel_;
  std::int64_t session_;
  std::int64_t seq_ = 0;
  std::deque<Remembered> commands_;  // newest first
  Loop::TimerId timer_;
};

}  // namespace berth
