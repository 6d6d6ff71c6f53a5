// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/pose_estimate_t.hpp>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "common/bus/loop.h"

namespace berth {

/// Lays the estimates of a live estimator beside the recorded ones of the same returns, whichever
/// comes first.
class EstimatePairs {
 public:
  /// @param show takes a line for each pair
  /// @param start of the log: times are shown after it
  EstimatePairs(Utime start, std::function<void(const std::string& line)> show)
      : start_(start), show_(std::move(show)) {}

  void recorded(const pose_estimate_t& estimate);
  void live(const pose_estimate_t& estimate);
  /// What waits for its other half waits no more: the player jumped.
  void forget();

  static std::string heading();
  std::string summary() const;
  std::int64_t pairs() const { return pairs_; }
  /// In all digits but those of seq, which counts messages, not measurements.
  std::int64_t same() const { return same_; }

 private:
  struct Half {
    std::optional<pose_estimate_t> recorded;
    std::optional<pose_estimate_t> live;
  };
  void compare_if_both(std::map<std::pair<std::int64_t, std::int32_t>, Half>::iterator at);

  Utime start_;
  std::function<void(const std::string&)> show_;
  std::map<std::pair<std::int64_t, std::int32_t>, Half> halves_;  // by scan and last packet
  std::int64_t pairs_ = 0;
  std::int64_t same_ = 0;
  std::int64_t both_good_ = 0;
  double largest_m_ = 0;
  double largest_rad_ = 0;
};

}  // namespace berth
