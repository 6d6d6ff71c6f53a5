// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/process_loop.h"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <system_error>

#include "common/bus/sockets.h"
#include "common/bus/worker.h"
#include "common/core/error.h"

namespace berth {
namespace {

Utime monotonic() {
  using namespace std::chrono;
  return duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
}

[[noreturn]] void throw_errno(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

Utime clock_offset_now() {
  using namespace std::chrono;
  return duration_cast<microseconds>(system_clock::now().time_since_epoch()).count() - monotonic();
}

Utime clock_offset_from_environment() {
  const char* text = std::getenv("BERTH_CLOCK_OFFSET_US");
  if (text == nullptr) return clock_offset_now();
  char* end = nullptr;
  const long long value = std::strtoll(text, &end, 10);
  if (end == text || *end != '\0') {
    throw InputError(std::string("environment variable BERTH_CLOCK_OFFSET_US: found '") + text +
                     "', expected whole microseconds");
  }
  return value;
}

ProcessLoop::ProcessLoop(Utime clock_offset)
    : clock_offset_(clock_offset), wake_fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_fd_ < 0) throw_errno("eventfd");
  sockets_ = std::make_unique<Sockets>(*this);
}

ProcessLoop::~ProcessLoop() {
  sockets_.reset();
  close(wake_fd_);
  if (signal_fd_ >= 0) close(signal_fd_);
}

std::unique_ptr<Worker> ProcessLoop::make_worker() { return std::make_unique<ThreadWorker>(*this); }

Utime ProcessLoop::now() const { return monotonic() + clock_offset_; }

Loop::TimerId ProcessLoop::add(Utime when, Utime period, Task task) {
  const TimerId id = next_id_++;
  timer_of_[id] = timers_.emplace(when, Timer{id, period, std::move(task)});
  return id;
}

Loop::TimerId ProcessLoop::at(Utime when, Task task) { return add(when, 0, std::move(task)); }

Loop::TimerId ProcessLoop::every(Utime period, Task task) {
  return add(now() + period, period, std::move(task));
}

void ProcessLoop::cancel(TimerId timer) {
  const auto found = timer_of_.find(timer);
  if (found == timer_of_.end()) return;
  timers_.erase(found->second);
  timer_of_.erase(found);
}

void ProcessLoop::watch(int fd, Task readable) {
  watched_[fd] = {POLLIN, std::make_shared<Task>(std::move(readable))};
}

void ProcessLoop::watch_writable(int fd, Task writable) {
  watched_[fd] = {POLLOUT, std::make_shared<Task>(std::move(writable))};
}

void ProcessLoop::unwatch(int fd) { watched_.erase(fd); }

void ProcessLoop::post(Task task) {
  {
    const std::lock_guard lock(mutex_);
    posted_.push_back(std::move(task));
  }
  wake();
}

void ProcessLoop::stop() {
  post([this] { stopped_ = true; });
}

void ProcessLoop::wake() {
  const std::uint64_t one = 1;
  // A full counter means that the loop is already due to wake.
  [[maybe_unused]] const auto written = write(wake_fd_, &one, sizeof one);
}

void ProcessLoop::on_signals(std::function<void(int)> handler) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal_fd_ = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  if (signal_fd_ < 0) throw_errno("signalfd");
  watch(signal_fd_, [this, handler = std::move(handler)] {
    signalfd_siginfo info;
    while (read(signal_fd_, &info, sizeof info) == sizeof info) {
      handler(static_cast<int>(info.ssi_signo));
    }
  });
}

void ProcessLoop::run_posted() {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto got = read(wake_fd_, &count, sizeof count);
  std::vector<Task> tasks;
  {
    const std::lock_guard lock(mutex_);
    tasks.swap(posted_);
  }
  for (const Task& task : tasks) task();
}

void ProcessLoop::run_due_timers() {
  const Utime due = now();
  while (!timers_.empty() && timers_.begin()->first <= due) {
    auto node = timers_.extract(timers_.begin());
    const Timer timer = node.mapped();
    if (timer.period > 0) {
      // A late loop skips beats and stays on the grid.
      const Utime missed = (due - node.key()) / timer.period;
      node.key() += (missed + 1) * timer.period;
      timer_of_[timer.id] = timers_.insert(std::move(node));
    } else {
      timer_of_.erase(timer.id);
    }
    timer.task();
  }
}

void ProcessLoop::run() {
  stopped_ = false;
  std::vector<pollfd> set;
  while (!stopped_) {
    set.assign(1, {wake_fd_, POLLIN, 0});
    for (const auto& [fd, watch] : watched_) set.push_back({fd, watch.events, 0});
    timespec timeout{};
    if (!timers_.empty()) {
      const Utime wait = std::max<Utime>(0, timers_.begin()->first - now());
      timeout.tv_sec = wait / second;
      timeout.tv_nsec = (wait % second) * 1000;
    }
    if (ppoll(set.data(), set.size(), timers_.empty() ? nullptr : &timeout, nullptr) < 0 &&
        errno != EINTR) {
      throw_errno("ppoll");
    }
    run_due_timers();
    if (set[0].revents != 0) run_posted();
    for (std::size_t i = 1; i < set.size(); ++i) {
      if (set[i].revents == 0) continue;
      const auto found = watched_.find(set[i].fd);  // an earlier task may have unwatched it
      if (found == watched_.end()) continue;
      const std::shared_ptr<Task> task = found->second.task;
      (*task)();
    }
  }
}

}  // namespace berth
