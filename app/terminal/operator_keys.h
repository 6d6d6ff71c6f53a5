// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/terminal/style.h"

namespace berth::terminal {

/// What the operator types while a procedure runs, key by key, turned into what is asked of the
/// procedure. Abort is sent at once, always. A prompt takes the keys for its answer; Escape gives
/// them back. Knows no terminal.
class OperatorKeys {
 public:
  /// Command, prompt id and text are filled in.
  using Send = std::function<void(const procedure_command_t& command)>;

  /// observing: nothing is sent; only help and leaving.
  OperatorKeys(Send send, bool observing) : send_(std::move(send)), observing_(observing) {}

  void on(const procedure_state_t& state);
  void type(char key);
  /// Whether the operator wants to leave; the procedure goes on.
  bool leaves() const { return leaves_; }
  /// What is being typed, and what can be.
  std::vector<Line> lines() const;

 private:
  enum class Mode { keys, reason, answer };

  void type_command(char key);
  void type_text(char key);
  void finish_text();
  void send(std::int8_t command, const std::string& text = "");
  bool prompting() const { return state_ && state_->state == procedure_state_t::PROMPTING; }
  /// The choice that the text begins, or the text where any will do.
  std::optional<std::string> chosen() const;

  Send send_;
  bool observing_;
  std::optional<procedure_state_t> state_;
  Mode mode_ = Mode::keys;
  std::string text_;
  std::string remark_;  // about what was typed last
  bool help_ = false;
  bool leaves_ = false;
};

}  // namespace berth::terminal
