// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/event_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/loop.h"

namespace berth {

/// What an operator asks of a running procedure, on the bus: each command a few times over, so that
/// a lost datagram does not lose it; HOLD and ABORT until they are acknowledged. The engine obeys
/// it once.
class OperatorLink {
 public:
  /// name: who asks; the engine tells operators apart by it.
  OperatorLink(Bus& bus, Loop& loop, std::int64_t session, std::string name = operator_name());

  /// Command, prompt id and text are the caller's; the rest is filled in.
  void send(procedure_command_t command);
  /// The engine has heard a HOLD or ABORT when it says so, and has obeyed one when its state is
  /// what was asked for. Of the run's session.
  void on(const event_t& event);
  void on(const procedure_state_t& state);
  /// Repeats nothing any more.
  void give_up() { unacknowledged_.clear(); }
  /// Once: it is to be called twice a second by whoever has taken control.
  void keep_control();
  /// Who asks, as the engine says it.
  const std::string& name() const { return name_; }

  /// Of the one at this terminal: the user and the process.
  static std::string operator_name();

 private:
  void complete(procedure_command_t& command);
  void repeat_stops();

  Bus& bus_;
  Loop& loop_;
  std::int64_t session_;
  std::string name_;
  std::int64_t seq_ = 0;
  std::vector<procedure_command_t> unacknowledged_;  // HOLD, ABORT
  bool repeating_ = false;
};

}  // namespace berth
