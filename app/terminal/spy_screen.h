// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/terminal/spy_model.h"

namespace berth {

/// What the terminal shows and how keys change it: the table of channels, or one channel's fields.
class SpyScreen {
 public:
  /// Keys as they come: arrows (ESC [ A ...), page up and down, Enter, digits then Enter, q, ESC.
  /// @return false when the user wants to leave.
  bool key(const std::string& key, const SpyModel& model);

  /// The whole screen as text with ANSI colours, at most so many lines of so many columns.
  std::string draw(const SpyModel& model, Utime now, int rows, int columns) const;

 private:
  void move(int by, const SpyModel& model);
  void open(const SpyModel& model);

  std::string selected_;  ///< channel; empty: the first
  bool opened_ = false;
  int scroll_ = 0;  ///< of an opened channel
  std::string digits_;
};

}  // namespace berth
