// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "logs/types/value.h"

namespace berth::logs {

/// Where two messages of one type differ.
struct ValueDiff {
  bool differs = false;
  std::string path;  ///< of the first field that does
  std::string a;
  std::string b;
  double largest = 0;  ///< greatest difference of real numbers, also within the tolerance
};

/// ignored: whether a field's path does not count. NaN equals NaN.
ValueDiff diff_values(const StructType& type, const Value& a, const Value& b, double tolerance,
                      const std::function<bool(const std::string& path)>& ignored);

}  // namespace berth::logs
