// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/runs/run_files.h"
#include "app/terminal/progress.h"
#include "common/bus/bus.h"
#include "logs/file/log_event.h"

namespace berth::terminal {

/// Shows a running procedure on stdout: lasting lines, and on a real terminal below them a panel
/// that is redrawn all the time. Colours only where they are enabled.
class TerminalView {
 public:
  TerminalView();
  ~TerminalView() { clear_panel(); }
  TerminalView(const TerminalView&) = delete;
  TerminalView& operator=(const TerminalView&) = delete;

  template <class Message>
  void on(const Message& message) {
    progress_.on(message);
  }
  /// A message as the twin's recorder sees it.
  void take(const std::string& channel, Bytes bytes);
  /// Redraws the panel, with the lines given below it; no more often than an eye can follow unless
  /// urgent.
  void refresh(const std::vector<Line>& below = {}, bool urgent = false);
  /// A lasting line.
  void print(const Line& line);
  void clear_panel();

 private:
  bool is_terminal_;
  Progress progress_;
  logs::ReusedMessage<procedure_state_t> state_;  // may be long and comes often
  bool colours_;
  std::size_t panel_lines_ = 0;  // on the screen now
  double last_refresh_s_ = 0;
};

/// Prints a verdict's lines on stdout; on a terminal those of its table, which are indented, no
/// wider than it is.
void print_verdict(const std::string& text);
/// Prints verdict.txt of a run, and where the run and its report lie.
void show_verdict(const RunFiles& files);

}  // namespace berth::terminal
