// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/command_answers_t.hpp>
#include <deque>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/loop.h"

namespace berth {

/// A node's answers to its commands, published as command_answers_t: accepted, or refused with the
/// reason. Tells a repetition from a new command and answers it again, so that a command whose
/// answer was lost is obeyed once. Remembers the last 1000 commands.
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
  /// It could not be carried out for now: its repetition is a new command.
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
  /// Out of the list; not given where it was not in it.
  Remembered take(const command_answer_t& named);
  command_answers_t current() const;
  void publish();

  Bus& bus_;
  Loop& loop_;
  std::string channel_;
  std::int64_t session_;
  std::int64_t seq_ = 0;
  std::deque<Remembered> commands_;  // the one received last first
  Loop::TimerId timer_;
};

}  // namespace berth
