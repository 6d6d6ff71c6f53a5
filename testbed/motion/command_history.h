// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "common/core/pose.h"
#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

inline Pose blend(const Pose& a, const Pose& b, double s) { return interpolate(a, b, s); }

/// Commands of the last seconds, interpolated in time: of any type with a blend(a, b, share), such
/// as the joints of both arms or a relative pose. Times in us.
template <class Commanded>
class CommandHistory {
 public:
  using Entry = std::pair<std::int64_t, Commanded>;

  /// Commands older than `length`, us, are dropped.
  explicit CommandHistory(std::int64_t length = 20000000) : length_(length) {}

  /// t: later than those before.
  void add(std::int64_t t, const Commanded& commanded) {
    entries_.emplace_back(t, commanded);
    while (entries_.size() > 2 && entries_[1].first < t - length_) entries_.pop_front();
  }
  void clear() { entries_.clear(); }
  /// Between the commands around t; the first one before all, the last one after all. Nothing when
  /// there is none.
  std::optional<Commanded> at(std::int64_t t) const {
    if (entries_.empty()) return std::nullopt;
    const auto after =
        std::lower_bound(entries_.begin(), entries_.end(), t,
                         [](const Entry& entry, std::int64_t time) { return entry.first < time; });
    if (after == entries_.end()) return entries_.back().second;
    if (after == entries_.begin()) return after->second;
    const auto before = std::prev(after);
    const double s =
        static_cast<double>(t - before->first) / static_cast<double>(after->first - before->first);
    return blend(before->second, after->second, s);
  }
  /// Oldest first.
  const std::deque<Entry>& entries() const { return entries_; }

  /// Every command transformed: change(utime, commanded).
  template <class Change>
  auto mapped(Change change) const {
    CommandHistory<decltype(change(std::int64_t{}, std::declval<Commanded>()))> other(length_);
    for (const auto& [t, commanded] : entries_) other.add(t, change(t, commanded));
    return other;
  }

 private:
  std::int64_t length_;
  std::deque<Entry> entries_;
};

/// Of the joints of both arms.
using JointHistory = CommandHistory<ArmPair>;
/// Of T_sensor_model.
using PoseHistory = CommandHistory<Pose>;

}  // namespace berth::testbed
