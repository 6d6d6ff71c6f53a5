// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/operator_control_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/terminal/style.h"
#include "common/bus/commands.h"

namespace berth::terminal {

/// What the operator types while a procedure runs, key by key, turned into requests to the
/// procedure. Abort is sent at once, always. A prompt takes the keys for its answer; Escape gives
/// them back. Knows no terminal.
class OperatorKeys {
 public:
  /// Command, prompt id and text are filled in.
  using Send = std::function<void(const procedure_command_t& command)>;

  /// observing: nothing is sent; only help and leaving. name: whose keys these are, to the engine.
  OperatorKeys(Send send, bool observing, std::string name = "")
      : send_(std::move(send)), observing_(observing), name_(std::move(name)) {}

  void on(const procedure_state_t& state);
  /// How a command of these keys ended.
  void on_answer(CommandStatus status, const std::string& reason);
  void on(const operator_control_t& control) { holder_ = control.holder; }
  void on(const testbed_state_t& state) { speed_ = state.speed_override; }
  void type(char key);
  /// Whether the operator wants to leave; the procedure goes on.
  bool leaves() const { return leaves_; }
  /// Whether this operator has control, which has to be kept.
  bool has_control() const { return !name_.empty() && holder_ == name_; }
  /// What is being typed, and what can be.
  std::vector<Line> lines() const;

 private:
  enum class Mode { keys, reason, answer };

  void type_command(char key);
  void type_text(char key);
  void take_or_release_control();
  void change_speed(double by);
  void finish_text();
  void send(std::int8_t command, const std::string& text = "");
  bool prompting() const { return state_ && state_->state == procedure_state_t::PROMPTING; }
  /// The choice that the text begins, or the text where any will do.
  std::optional<std::string> chosen() const;

  Send send_;
  bool observing_;
  std::string name_;
  std::string holder_;
  double speed_ = 1;
  std::string requested_over_;  // holder of control at the time it was shown
  std::optional<procedure_state_t> state_;
  Mode mode_ = Mode::keys;
  std::string text_;
  std::string remark_;  // about what was typed last
  bool help_ = false;
  bool leaves_ = false;
};

}  // namespace berth::terminal
