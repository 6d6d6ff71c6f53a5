// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/clouds/cloud.h"
#include "estimator/single_scan.h"

namespace berth::commands {

/// Puts into the result's reason which points were dropped, and why, where that decides the
/// outcome, and into its notes what a cloud looks like that is in another unit or frame.
/// target_length: m.
void add_hints(const clouds::Cloud& cloud, const estimator::PreprocessedScan& scan,
               double target_length, estimator::SingleScanResult& result);

}  // namespace berth::commands
