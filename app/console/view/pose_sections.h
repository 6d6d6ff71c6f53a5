// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "app/console/view/json.h"
#include "evaluation/measure/measurer.h"

namespace berth::console {

/// The section `truth`.
std::string truth_json(const evaluation::TruthSample& truth);

/// The section `estimate`. compared: against truth, where truth is known already; latency: from the
/// last return to when the estimate was published.
std::string estimate_json(const pose_estimate_t& estimate,
                          const std::optional<evaluation::ComparedEstimate>& compared,
                          std::optional<Utime> latency);

/// Ellipsoid of one standard deviation: its half axes, longest last, and the rotation that turns
/// x, y, z into their directions.
struct Ellipsoid {
  Vector3d radii;
  Quaterniond rotation;
};
Ellipsoid ellipsoid_of(const Matrix3d& covariance);

}  // namespace berth::console
