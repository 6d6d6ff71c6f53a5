// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_command_t.hpp>
#include <berth/inertial_motion_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <string>
#include <vector>

#include "estimator/acquire/acquisition.h"
#include "estimator/beam/scan.h"
#include "estimator/filter/target_tracker.h"
#include "estimator/plan/scan_planner.h"
#include "estimator/track/tracking.h"
#include "lcmtypes/scan_packet.h"

namespace berth::estimator {

// Between messages and the estimator's own types.

/// Conversions between messages and the estimator's types.
///
/// Whether all values are in range.
bool is_well_formed(const ScanPacket& packet);
/// Time of its last beam; without beams, the packet's own time.
std::int64_t utime_of_end(const ScanPacket& packet);
/// The beams with their ranges reduced to the sensor's origin.
void append_beams(const ScanPacket& packet, std::vector<RawBeam>& beams);

/// Whether all values are in range and the interval is positive.
bool is_well_formed(const inertial_motion_t& motion);
SensorMotion sensor_motion_of(const inertial_motion_t& motion);

/// Empty, or the invalid value of a command.
std::string why_malformed(const estimator_command_t& command);

/// Of independent errors, 1 sigma on each axis in translation, m, and rotation, rad.
Matrix6d diagonal_covariance(double translation, double rotation);
void fill_measurement(const TrackingResult& measured, pose_estimate_t& estimate);
/// Also sets the estimate's pose to the best hypothesis.
void fill_hypotheses(const std::vector<Hypothesis>& hypotheses, pose_estimate_t& estimate);

}  // namespace berth::estimator
