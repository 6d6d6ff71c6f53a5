// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/operator_control_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <functional>
#include <list>
#include <optional>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/commands.h"

namespace berth {

/// Commands of operators to the procedure that runs, each repeated until the engine answers it.
class ProcedureClient {
 public:
  /// accepted, refused or unanswered, with the reason.
  using Done = std::function<void(CommandStatus, const std::string& reason)>;

  /// name: the operator's, by which the engine distinguishes operators. Make it before the bus
  /// starts.
  ProcedureClient(Bus& bus, Loop& loop, std::int64_t session, std::string name = operator_name());
  ~ProcedureClient();
  ProcedureClient(const ProcedureClient&) = delete;
  ProcedureClient& operator=(const ProcedureClient&) = delete;

  /// Command, prompt id and text are the caller's, and the commander where it is not this
  /// operator. HOLD and ABORT are repeated until the procedure has gone, others for 2 s.
  /// done is called once, later.
  void send(procedure_command_t command, Done done = {});
  /// The same, given up after the time limit (us).
  void send(procedure_command_t command, Done done, Utime time_limit);
  /// Once: the holder of control must call it twice a second. Empty: this operator.
  void keep_control(const std::string& holder = "");

  /// Whether there is an engine that has not finished.
  bool active() const;
  const std::optional<procedure_state_t>& state() const { return state_; }
  /// The holder of control; none where nothing runs.
  operator_control_t control() const { return active() ? control_ : operator_control_t{}; }
  /// The operator's name, as the engine has it.
  const std::string& name() const { return commander_.name; }

  /// Of the one at this terminal: the user and the process.
  static std::string operator_name();

 private:
  struct Request {
    CommandClient<procedure_command_t> client;
    Done done;
  };

  Commander as(const std::string& name);
  void publish(const procedure_command_t& command);
  void tick();
  /// Notifies the senders of answered requests.
  void finish_answered();

  Bus& bus_;
  Loop& loop_;
  Commander commander_;
  std::list<Request> requests_;
  Loop::TimerId timer_ = 0;
  std::optional<procedure_state_t> state_;
  Utime state_received_ = 0;
  operator_control_t control_{};
};

}  // namespace berth
