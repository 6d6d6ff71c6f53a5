// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/finding.h"
#include "common/bus/loop.h"

namespace berth {

/// How soon a device answers.
class RoundTrips {
 public:
  void add(Utime time) { times_.push_back(seconds(time)); }
  /// Of a read without an answer: why.
  void miss(const std::string& why) {
    ++missed_;
    why_ = why;
  }
  std::size_t answered() const { return times_.size(); }
  /// Of the newest miss.
  const std::string& why() const { return why_; }
  /// The half of them, or so many of 1, came within it. @pre answered() > 0
  Utime quantile(double share) const;

  /// period: at which the driver asks; timeout: after which it gives an answer up.
  Finding finding(const std::string& device, Utime period, Utime timeout) const;

 private:
  std::vector<double> times_;  // s
  std::size_t missed_ = 0;
  std::string why_;
};

}  // namespace berth
