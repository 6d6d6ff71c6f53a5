// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/event_t.hpp>
#include <berth/operator_control_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "app/terminal/operator_link.h"

namespace berth::console {

/// How an asking ended, with words for who asked.
using Done = std::function<void(bool accepted, const std::string& text)>;

/// Steers the procedure that runs, for several operators: each asks under a name of their own, as
/// terminals do, and is told whether the engine has refused.
class ProcedureHelm {
 public:
  static constexpr char no_answer[] = "the procedure does not answer";

  ProcedureHelm(Bus& bus, Loop& loop, std::int64_t session);

  void on(const procedure_state_t& state);
  void on(const operator_control_t& control);
  /// The engine says what it was asked for, and at once what it has against it.
  void on(const event_t& event);
  /// At 20 Hz: what has been heard and not refused is accepted.
  void tick();

  /// done is called once, later; with no_answer when there was none: then it is asked no more.
  void ask(const std::string& who, procedure_command_t command, Done done);
  void keep_control(const std::string& who);

  /// Whether there is an engine that has not finished.
  bool active() const;
  const std::optional<procedure_state_t>& state() const { return state_; }
  /// Who steers; without a holder where nothing runs.
  const operator_control_t& control() const { return control_; }

 private:
  struct Asked {
    std::string who;
    Done done;
    Utime sent = 0;
    Utime heard = 0;  // by the engine; 0: not yet
    int number = 0;
  };

  OperatorLink& link(const std::string& who);
  void end(int number, bool accepted, const std::string& text);

  Bus& bus_;
  Loop& loop_;
  std::int64_t session_;
  std::map<std::string, OperatorLink> links_;
  std::deque<Asked> asked_;
  int count_ = 0;
  int heard_last_ = 0;  // number of the asking that the engine spoke of last; 0: another's
  std::optional<procedure_state_t> state_;
  Utime state_heard_ = 0;
  operator_control_t control_{};
};

}  // namespace berth::console
