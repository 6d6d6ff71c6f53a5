// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/clouds/cloud.h"
#include "estimator/single_scan.h"

namespace berth::commands {

/// Adds to the result's reason the dropped points, with the cause, where they decide the outcome;
/// adds to its notes that a cloud looks as if in another unit or frame. target_length: m.
void add_hints(const clouds::Cloud& cloud, const estimator::PreprocessedScan& scan,
               double target_length, estimator::SingleScanResult& result);

}  // namespace berth::commands
