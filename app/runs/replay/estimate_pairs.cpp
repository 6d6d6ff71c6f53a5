// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/estimate_pairs.h"

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
                "%lld estimates beside recorded ones, %lld the same number for number; %lld good "
                "in both, at most %.3f mm and %.4f deg apart",
                static_cast<long long>(pairs_), static_cast<long long>(same_),
                static_cast<long long>(both_good_), 1e3 * largest_m_, degrees(largest_rad_));
  return text;
}

}  // namespace berth
