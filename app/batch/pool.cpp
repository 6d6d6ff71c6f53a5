// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/pool.h"

#include <poll.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <optional>
#include <thread>

#include "app/batch/shared_values.h"

namespace berth {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int look_about_ms = 250;

double seconds_since(Clock::time_point begun) {
  return std::chrono::duration<double>(Clock::now() - begun).count();
}

ChildOptions options_of(const Task& task) {
  ChildOptions options;
  options.output_file = task.output;
  return options;
}

}  // namespace

struct Pool::Running {
  explicit Running(Task what) : task(std::move(what)) {
    if (task.program.empty()) {
      process.emplace([this] { return run_body(); }, options_of(task));
    } else {
      process.emplace(task.program, options_of(task));
    }
  }

  TaskEnd end(const ProcessEnd& how) const {
    return {process->pid(), how, seconds_since(begun), too_long, false, error[0].get()};
  }

  /// In the copy of this process. @return exit status
  int run_body() {
    try {
      task.body();
      return 0;
    } catch (const std::exception& thrown) {
      error[0].set(thrown.what());
      return 1;
    }
  }

  Task task;
  SharedValues<SharedText> error{1};
  Clock::time_point begun = Clock::now();
  std::optional<ChildProcess> process;
  bool too_long = false;
};

int jobs_of(int requested) {
  if (requested > 0) return requested;
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

Pool::Pool(PoolOptions options) : options_(std::move(options)) {
  options_.jobs = jobs_of(options_.jobs);
}

Pool::~Pool() = default;

void Pool::run() {
  const auto begun = Clock::now();
  while (true) {
    const bool time_is_up =
        options_.time_budget_s > 0 && seconds_since(begun) > options_.time_budget_s;
    while (!time_is_up && !waiting_.empty() && may_begin(waiting_.front())) {
      running_.emplace_back(std::move(waiting_.front()));
      waiting_.pop_front();
    }
    if (running_.empty()) break;
    wait();
    try {
      reap();
    } catch (...) {
      interrupt();
      throw;
    }
    if (options_.watch) options_.watch();
    if (options_.interrupted && options_.interrupted()) {
      interrupt();
      break;
    }
  }
  waiting_.clear();
}

bool Pool::may_begin(const Task& task) const {
  if (running_.empty()) return true;
  if (task.alone || running_.front().task.alone) return false;
  return running_.size() < static_cast<std::size_t>(options_.jobs);
}

void Pool::wait() const {
  std::vector<pollfd> all;
  for (const Running& one : running_) all.push_back({one.process->descriptor(), POLLIN, 0});
  poll(all.data(), all.size(), look_about_ms);
}

void Pool::reap() {
  for (auto one = running_.begin(); one != running_.end();) {
    const auto how = one->process->wait_for(std::chrono::milliseconds(0));
    if (how) {
      std::list<Running> ended;  // so that ended() sees the tasks that still run
      ended.splice(ended.begin(), running_, one++);
      ended.front().task.ended(ended.front().end(*how));
      continue;
    }
    const double limit = one->task.time_limit_s;
    if (limit > 0 && !one->too_long && seconds_since(one->begun) > limit) {
      one->too_long = true;
      one->process->signal(SIGKILL);
    }
    ++one;
  }
}

void Pool::interrupt() {
  waiting_.clear();
  for (const Running& one : running_) one.process->signal(SIGKILL);
  while (!running_.empty()) {
    Running& one = running_.front();
    TaskEnd end = one.end(one.process->wait());
    end.interrupted = true;
    one.task.ended(end);
    running_.pop_front();
  }
}

}  // namespace berth
