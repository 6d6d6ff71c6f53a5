// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/live_estimator.h"

#include <algorithm>

namespace berth {

LiveEstimator::LiveEstimator(const RunFiles& files, Utime start, FoldBus::Outlet publish)
    : files_(files), publish_(std::move(publish)) {
  fold_ = std::make_unique<EstimatorFold>(files_, start, publish_);
  thread_ = std::thread([this] { work(); });
}

LiveEstimator::~LiveEstimator() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void LiveEstimator::put(Task task) {
  {
    const std::lock_guard lock(mutex_);
    // Of messages that only set the time the last one is enough.
    const bool only_time = !task.restart && task.bytes.empty();
    if (only_time && !tasks_.empty() && !tasks_.back().restart && tasks_.back().bytes.empty()) {
      tasks_.back().utime = task.utime;
      return;
    }
    tasks_.push_back(std::move(task));
  }
  changed_.notify_all();
}

void LiveEstimator::take(const logs::LogEvent& event) {
  Task task;
  task.utime = event.utime;
  if (EstimatorFold::is_input(event)) {
    task.channel = event.channel;
    task.bytes.assign(event.data.begin(), event.data.end());
  }
  put(std::move(task));
}

void LiveEstimator::restart(Utime start) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.clear();
  }
  Task task;
  task.restart = true;
  task.utime = start;
  put(std::move(task));
}

void LiveEstimator::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stopping_ || (tasks_.empty() && !working_); });
}

std::size_t LiveEstimator::waiting() {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::count_if(
      tasks_.begin(), tasks_.end(), [](const Task& task) { return !task.bytes.empty(); }));
}

std::string LiveEstimator::error() {
  const std::lock_guard lock(mutex_);
  return error_;
}

void LiveEstimator::carry_out(const Task& task) {
  if (task.restart) {
    fold_.reset();
    fold_ = std::make_unique<EstimatorFold>(files_, task.utime, publish_);
    return;
  }
  logs::LogEvent event;
  event.utime = task.utime;
  event.channel = task.channel;
  event.data = task.bytes;
  fold_->take(event);
}

void LiveEstimator::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || !tasks_.empty(); });
    if (stopping_) return;
    const Task task = std::move(tasks_.front());
    tasks_.pop_front();
    working_ = true;
    lock.unlock();
    try {
      carry_out(task);
      lock.lock();
    } catch (const std::exception& error) {
      lock.lock();
      error_ = error.what();
      stopping_ = true;
    }
    working_ = false;
    if (tasks_.empty() || stopping_) changed_.notify_all();
  }
}

}  // namespace berth
