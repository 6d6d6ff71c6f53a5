// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "test/benchmarks/tracking_trial.h"

namespace berth::benchmark {

/// A point of a surface and its unit normal, of either sign. Model frame, m.
struct SurfacePoint {
  Vector3d position;
  Vector3d normal;
};

/// So many points uniform over the mesh's area, exactly on its faces.
std::vector<SurfacePoint> points_on(const Mesh& mesh, int count, Random random);

/// The samples of what can be seen of a compiled model.
std::vector<SurfacePoint> points_of(const estimator::TargetModel& model);

/// How PCL's registrations are run.
struct ReferenceOptions {
  std::vector<double> gates = {0.1};  ///< m, one after another: beyond what the start is off
  bool gicp = true;                   ///< GICP, too; within the first gate
};

/// What PCL's registrations make of the same clouds from the same starts: exact normals of the
/// mesh, turned to the sensor, tree built beforehand. By method: "icp_with_normals", "gicp".
/// Covariance and status are not theirs to give: nees stays 0, ok true.
/// @param file where to write the clouds meanwhile
/// @throws InputError when the program is not there or fails.
std::map<std::string, std::vector<TrackingOutcome>> reference_registrations(
    const std::vector<SurfacePoint>& surface, const std::vector<TrackingTrial>& trials,
    const std::filesystem::path& file, const ReferenceOptions& options = {});

}  // namespace berth::benchmark
