// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "evaluation/targets/target_measurement.h"

namespace berth::targets {

/// A target.yaml with measured values for its parts: keys that are there get the value, others are
/// added; comments and all else stay as they are. Angles become the joint's `rest`.
/// @param name stands in for the file in messages @throws InputError when it cannot be written so
std::string with_measured(const std::string& yaml, const std::string& name,
                          const std::vector<PartMeasurement>& parts);

}  // namespace berth::targets
