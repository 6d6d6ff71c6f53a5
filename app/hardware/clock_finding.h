// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/finding.h"
#include "common/bus/clock_map.h"

namespace berth {

/// A device's clock against this machine's, watched for so long.
/// bracket: us within which one reading settles the offset
Finding clock_finding(const std::string& device, const ClockLine& line, int jumps, Utime bracket,
                      Utime span);

}  // namespace berth
