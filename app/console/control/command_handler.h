// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "app/console/control/cell_client.h"
#include "app/console/control/page_command.h"
#include "app/console/server/command.h"
#include "app/terminal/procedure_client.h"
#include "common/core/lease.h"

namespace berth::console {

/// A procedure to be run, as a page requests it.
struct RunOrder {
  std::string procedure;                          ///< as in the section `procedures`
  std::map<std::string, std::string> parameters;  ///< what differs from the procedure's own
  std::string operator_name;                      ///< of the requester
};

/// Services that the handler needs.
struct CommandHandlerHost {
  /// To one viewer.
  std::function<void(const std::string& viewer, const Answer& answer)> answer;
  /// For the log: severity, code, text.
  std::function<void(std::int8_t severity, const std::string& code, const std::string& text)> event;
  /// Starts a run; @return the reason why not, or nothing. Its progress is seen on the bus.
  std::function<std::string(const RunOrder& order)> run;
};

struct CommandHandlerOptions {
  std::string name;            ///< of the console: its viewers are "NAME viewer-3" to the cell
  bool hold_when_lost = true;  ///< the procedure is held when its operator is lost
  std::int64_t session = 0;
};

/// Turns the requests of pages into commands on the bus, the same that terminals send. Only the
/// viewer that has control is obeyed, except that a hold is obeyed from every viewer. A command
/// that makes arms move, or takes control from its holder, is requested twice. Control is kept only
/// by the page that has it: a page that is closed, or stands still, loses it. Where no procedure
/// runs, control is the testbed's lease.
class CommandHandler {
 public:
  CommandHandler(Bus& bus, Loop& loop, CommandHandlerOptions options, CommandHandlerHost host);

  void take(const Command& command);

  /// At 20 Hz.
  void tick();

  /// The holder of control.
  struct Control {
    std::string holder;  ///< as the cell names it; empty: none
    std::string viewer;  ///< where it is a viewer of this console
    Utime utime_expires = 0;
    bool holds_when_lost = false;
    bool operator==(const Control&) const = default;
  };
  Control control() const;

 private:
  struct Verb;
  static const std::map<std::string, Verb>& verbs();

  std::string name_of(const std::string& viewer) const { return options_.name + " " + viewer; }
  /// Why this viewer is not obeyed; empty: it is.
  std::string reason_to_refuse(const Command& command, const Verb& verb) const;
  /// The consequence, where a command is to be requested twice; empty: none.
  std::string hazard(const Command& command) const;
  std::string what_goes_on() const;

  void answer(const Command& command, bool accepted, const std::string& text,
              const std::string& confirm = "");
  void refuse(const Command& command, const std::string& why);
  /// Passes the answer of the engine or the cell on to a viewer.
  ProcedureClient::Done answering(const Command& command);

  void take_control(const Command& command);
  void release_control(const Command& command);
  void keep_control(const Command& command);
  void hold(const Command& command);
  void run(const Command& command);
  void speed(const Command& command);
  void lamps(const Command& command);
  void prompt(const Command& command);
  /// To the engine; refused where there is none.
  void request(const Command& command, std::int8_t what, const std::string& text = "",
               const std::string& prompt_id = "");
  void send(const std::string& viewer, procedure_command_t request, ProcedureClient::Done done);
  void take_engine(const std::string& viewer, ProcedureClient::Done done);
  void follow_engine();
  void follow_testbed();

  Loop& loop_;
  CommandHandlerOptions options_;
  CommandHandlerHost host_;
  ProcedureClient procedure_;
  CellClient cell_;
  Confirmations confirmations_;
  Lease lease_;  // of a viewer of ours, as long as its page keeps it
  bool follows_engine_ = false;
  bool inherits_ = false;  // control of a procedure that has just begun; once lost it stays so
  Utime engine_requested_ = 0;
  Utime lease_requested_ = 0;
};

}  // namespace berth::console
