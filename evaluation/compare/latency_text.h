// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "evaluation/latency/latencies.h"

namespace berth::evaluation {

/// Of a table for people: latency, from what, ms, low, high, samples, remark. Of a clock the bounds
/// about its offset, which may be as large as the time since an epoch and is in the remark.
std::vector<std::string> latency_cells(const Latency& latency);

}  // namespace berth::evaluation
