// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/progress.h"

#include <unistd.h>

#include <cstdio>

#include "common/core/utc.h"

namespace berth::nights {

NightProgress::NightProgress(std::size_t done, std::size_t total)
    : before_(done), done_(done), total_(total), is_terminal_(isatty(STDOUT_FILENO) == 1) {}

double NightProgress::elapsed_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun_).count();
}

std::string NightProgress::status() const {
  const double elapsed = elapsed_s();
  const double each = elapsed / static_cast<double>(std::max<std::size_t>(1, done_ - before_));
  return std::to_string(done_) + " of " + std::to_string(total_) + " runs, " +
         std::to_string(not_passed_) + " did not pass; " + clock_text(elapsed) +
         " elapsed, about " + clock_text(each * static_cast<double>(total_ - done_)) + " to go";
}

void NightProgress::finished(const FinishedRun& run) {
  ++done_;
  if (!run.passed()) {
    ++not_passed_;
    clear();
    std::printf("%s %s seed %llu%s: %s\n", run.outcome.c_str(), run.case_name.c_str(),
                static_cast<unsigned long long>(run.seed),
                run.build == Build::baseline ? " (baseline)" : "", run.reason.c_str());
  }
  if (is_terminal_) {
    clear();
    std::printf("%s", status().c_str());
    line_shown_ = true;
  } else if (done_ * 20 / total_ != (done_ - 1) * 20 / total_) {
    std::printf("%s\n", status().c_str());
  }
  std::fflush(stdout);
}

void NightProgress::clear() {
  if (line_shown_) std::printf("\r\x1b[K");
  line_shown_ = false;
}

}  // namespace berth::nights
