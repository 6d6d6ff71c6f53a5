// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "app/doctor/finding.h"

namespace berth {

/// Multicast route, socket buffers, loopback self test on the URL, recorder, disk, clock, other
/// runs.
std::vector<Finding> examine(const std::string& url);

}  // namespace berth
