// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "app/terminal/progress_line.h"

namespace berth::benchmark {

/// The results of trial(0) ... trial(count - 1), which must not depend on one another. The first
/// exception of a trial ends them all.
template <typename Trial>
auto results_of(const std::string& what, int count, int jobs, const Trial& trial) {
  using Result = decltype(trial(0));
  std::vector<Result> results(static_cast<std::size_t>(count));
  std::atomic<int> next = 0;
  int done = 0;
  std::mutex mutex;  // of done and error
  terminal::ProgressLine progress("trials of " + what, count);
  std::exception_ptr error;
  const auto work = [&] {
    try {
      for (int i = next++; i < count; i = next++) {
        results[static_cast<std::size_t>(i)] = trial(i);
        const std::lock_guard lock(mutex);
        progress.show(++done);
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (error == nullptr) error = std::current_exception();
      next = count;
    }
  };
  std::vector<std::jthread> helpers;
  for (int i = 1; i < jobs; ++i) helpers.emplace_back(work);
  work();
  helpers.clear();
  if (error != nullptr) std::rethrow_exception(error);
  return results;
}

}  // namespace berth::benchmark
