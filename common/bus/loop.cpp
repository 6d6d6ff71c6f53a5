// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/loop.h"

#include <cmath>

namespace berth {

Utime utime_from_seconds(double s) { return static_cast<Utime>(std::llround(s * 1e6)); }

}  // namespace berth
