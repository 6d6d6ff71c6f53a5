// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/event_t.hpp>
#include <berth/ground_truth_t.hpp>
#include <berth/operator_control_t.hpp>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/terminal/style.h"
#include "evaluation/measure/truth_join.h"
#include "lcmtypes/latest_messages.h"

namespace berth::terminal {

/// What an operator reads while a procedure runs: a lasting line for everything that happens, and
/// a panel of how things stand. Knows no terminal.
class Progress {
 public:
  using Print = std::function<void(const Line& line)>;

  /// print gets the lasting lines.
  /// @param with_panel what is waited for stands in the panel, and needs no lasting line
  explicit Progress(Print print, bool with_panel = false)
      : print_(std::move(print)), with_panel_(with_panel) {}

  void on(const procedure_state_t& message);
  void on(const run_info_t& message) { error_.on(message); }
  void on(const pose_estimate_t& message);
  void on(const ground_truth_t& message) { error_.on(message); }
  void on(const testbed_state_t& message) { latest_.on(message); }
  void on(const operator_control_t& message) { holder_ = message.holder; }
  /// Prints warnings and worse, and the commands that the procedure received.
  void on(const event_t& message);

  /// How things stand now.
  std::vector<Line> panel() const;
  /// The estimate: status, range, rate, error, clearance.
  std::string status() const;
  const std::optional<procedure_state_t>& state() const { return latest_.procedure; }
  bool finished() const;
  /// Outcome and criteria; empty until finished.
  std::string verdict() const;

 private:
  void print_changes(const procedure_state_t& message);
  /// The missing preconditions until the procedure begins; then one line: all met, or the list.
  void print_preparation(const procedure_state_t& message);
  void print_steps(const procedure_state_t& message);
  void print_prompt(const procedure_state_t& message);

  Print print_;
  bool with_panel_;
  LatestMessages latest_;
  std::string waiting_for_;
  Utime waited_since_ = 0;  // it was printed
  std::string holder_;      // of control; empty: none
  evaluation::LiveError error_;
  std::deque<Utime> good_;  // times of the good estimates of the last seconds
};

}  // namespace berth::terminal
