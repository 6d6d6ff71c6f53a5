// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/core/table.h"

namespace berth::evaluation {

/// One delay between LIDAR, arms and host as a run's data show it, with its 95 % interval. Times in
/// s; NaN where it could not be measured, and then the remark gives the reason.
struct Latency {
  enum class Kind {
    delay,  ///< estimated from motion
    clock,  ///< a device's clock minus the host's, as its driver brackets it
    trip    ///< round trip, from request to answer: the median and 95 % of them
  };
  std::string name;
  Kind kind = Kind::delay;
  double value;
  double low;
  double high;
  double sigma_information = 0;  ///< of a delay: standard error by the data's covariances
  double sigma_bootstrap = 0;    ///< of a delay: the same from blocks drawn again
  double sigma_offset = 0;       ///< of a delay: from truth's own constant errors
  std::size_t samples = 0;
  std::string remark;
};

/// For people in ms, of a clock the bounds about its offset, which may be as large as the time
/// since an epoch and is in the note; in JSON in s.
Table latency_table(const std::vector<Latency>& latencies);

}  // namespace berth::evaluation
