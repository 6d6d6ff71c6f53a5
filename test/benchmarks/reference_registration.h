// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "test/benchmarks/tracking_trial.h"

namespace berth::benchmark {

/// What PCL's registrations make of the same clouds from the same starts: exact normals of the
/// mesh, tree built beforehand. By method: "icp_with_normals", "gicp". Covariance and status are
/// not theirs to give: nees stays 0, ok true.
std::map<std::string, std::vector<TrackingOutcome>> reference_registrations(
    const estimator::TargetModel& model, const std::vector<TrackingTrial>& trials,
    const std::filesystem::path& directory);

}  // namespace berth::benchmark
