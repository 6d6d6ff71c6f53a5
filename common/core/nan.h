// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

namespace berth {

/// A value that was not measured, or does not apply.
inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

}  // namespace berth
