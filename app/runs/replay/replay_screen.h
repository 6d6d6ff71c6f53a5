// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace berth {

/// Lasting lines, and on a terminal a last line that is written anew all the time.
class ReplayScreen {
 public:
  ReplayScreen();
  ~ReplayScreen() { clear(); }
  ReplayScreen(const ReplayScreen&) = delete;
  ReplayScreen& operator=(const ReplayScreen&) = delete;

  void print(const std::string& line);
  /// Nothing where there is no terminal.
  void status(const std::string& line);

 private:
  void clear();

  bool is_terminal_;
  std::string status_;
};

/// "12.345 s", or "1:02:03.4" from an hour on.
std::string text_of_position(double seconds);

}  // namespace berth
