// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace berth {

/// The value with so many decimals, for messages to people: fixed(3.14159, 2) is "3.14".
std::string fixed(double value, int decimals);

/// Four significant digits, plainly written: 1234, 3.142, 0.042; "-" for NaN.
std::string shown(double value);

/// The words with ", " between them.
std::string joined(const std::vector<std::string>& words);

}  // namespace berth
