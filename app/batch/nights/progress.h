// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>

#include "app/batch/nights/history.h"

namespace berth::nights {

/// Tells a terminal how far a night is: a line that renews itself, and a line of its own for each
/// run that did not pass. Into a file: a line for every twentieth part of the night.
class NightProgress {
 public:
  NightProgress(std::size_t done, std::size_t total);
  ~NightProgress() { clear(); }
  NightProgress(const NightProgress&) = delete;
  NightProgress& operator=(const NightProgress&) = delete;

  void finished(const FinishedRun& run);
  double elapsed_s() const;

 private:
  std::string status() const;
  void clear();

  std::chrono::steady_clock::time_point begun_ = std::chrono::steady_clock::now();
  std::size_t before_;  // done by the night that was interrupted
  std::size_t done_;
  std::size_t total_;
  std::size_t not_passed_ = 0;
  bool is_terminal_;
  bool line_shown_ = false;
};

}  // namespace berth::nights
