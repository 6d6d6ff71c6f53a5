// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

namespace berth::report {

/// The points worth drawing where x from low to high is so many columns wide: of each column the
/// first, the least, the greatest and the last, in the order of x, and every point that is not
/// finite and breaks the line. Indices into x and y. Short curves are kept whole.
/// x must not decrease.
std::vector<std::size_t> worth_drawing(const std::vector<double>& x, const std::vector<double>& y,
                                       double low, double high, std::size_t columns);

}  // namespace berth::report
