// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace berth {

/// The value with so many decimals, for messages to people: fixed(3.14159, 2) is "3.14".
std::string fixed(double value, int decimals);

}  // namespace berth
