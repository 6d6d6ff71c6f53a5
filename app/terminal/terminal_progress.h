// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/runs/run_files.h"
#include "app/terminal/progress.h"
#include "common/bus/bus.h"
#include "common/bus/loop.h"

namespace berth {

/// Shows a running procedure in the terminal: lasting lines, and on a real terminal one line that
/// is written anew all the time.
class TerminalProgress {
 public:
  TerminalProgress();

  template <class Message>
  void on(const Message& message) {
    progress_.on(message);
  }
  /// A message as the twin's recorder sees it.
  void take(const std::string& channel, Bytes bytes);
  /// Writes the line of now; at most so often as an eye can follow.
  void refresh();

 private:
  void print(const std::string& line);
  void clear_line();

  terminal::Progress progress_;
  bool is_terminal_;
  bool line_shown_ = false;
  double last_refresh_s_ = 0;
};

/// Prints verdict.txt of a run and where the run lies.
void show_verdict(const RunFiles& files);

}  // namespace berth
