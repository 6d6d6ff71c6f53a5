// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/live_estimator.h"

#include <algorithm>
#include <cstdio>
#include <vector>

#include "common/core/pose.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/words.h"

namespace berth {
namespace {

std::vector<std::uint8_t> digits(pose_estimate_t estimate) {
  estimate.seq = 0;
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(estimate.getEncodedSize()));
  estimate.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace

void EstimatePairs::recorded(const pose_estimate_t& estimate) {
  const auto at = halves_.try_emplace({estimate.scan_id, estimate.last_packet}).first;
  at->second.recorded = estimate;
  compare_if_both(at);
}

void EstimatePairs::live(const pose_estimate_t& estimate) {
  const auto at = halves_.try_emplace({estimate.scan_id, estimate.last_packet}).first;
  at->second.live = estimate;
  compare_if_both(at);
}

void EstimatePairs::forget() { halves_.clear(); }

void EstimatePairs::compare_if_both(
    std::map<std::pair<std::int64_t, std::int32_t>, Half>::iterator at) {
  if (!at->second.recorded || !at->second.live) return;
  const pose_estimate_t& recorded = *at->second.recorded;
  const pose_estimate_t& live = *at->second.live;
  ++pairs_;
  const bool is_same = digits(recorded) == digits(live);
  if (is_same) ++same_;
  std::string apart = "same";
  if (recorded.status == pose_estimate_t::OK && live.status == pose_estimate_t::OK) {
    ++both_good_;
    const Vector6d d = difference(pose_of(recorded), pose_of(live));
    largest_m_ = std::max(largest_m_, d.head<3>().norm());
    largest_rad_ = std::max(largest_rad_, d.tail<3>().norm());
    if (!is_same) {
      char text[60];
      std::snprintf(text, sizeof text, "%.3f mm %.4f deg", 1e3 * d.head<3>().norm(),
                    degrees(d.tail<3>().norm()));
      apart = text;
    }
  } else if (!is_same) {
    apart = "other";
  }
  const auto p = xyzwpr_from_pose(pose_of(live));
  char line[200];
  std::snprintf(line, sizeof line,
                "%9.3f s %6lld  %-9s %-9s %9.1f %9.1f %9.1f %8.2f %8.2f %8.2f  %s",
                seconds(live.utime - start_), static_cast<long long>(live.scan_id),
                words::of_estimate_status(recorded.status), words::of_estimate_status(live.status),
                p[0], p[1], p[2], p[3], p[4], p[5], apart.c_str());
  show_(line);
  halves_.erase(at);
}

std::string EstimatePairs::heading() {
  return "     time    scan  recorded  live         x mm      y mm      z mm    w deg    p deg    "
         "r "
         "deg  live - recorded";
}

std::string EstimatePairs::summary() const {
  char text[200];
  std::snprintf(text, sizeof text,
                "%lld estimates compared with recorded ones, %lld identical; %lld good "
                "in both, at most %.3f mm and %.4f deg apart",
                static_cast<long long>(pairs_), static_cast<long long>(same_),
                static_cast<long long>(both_good_), 1e3 * largest_m_, degrees(largest_rad_));
  return text;
}

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
