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

/// Numbers that can be counted with.
bool is_well_formed(const ScanPacket& packet);
/// When its last beam was sent; with no beams, the packet's own time.
std::int64_t utime_of_end(const ScanPacket& packet);
/// The first return of each beam, seen from the sensor's origin.
void append_beams(const ScanPacket& packet, std::vector<RawBeam>& beams);

/// Numbers that can be counted with, over some time.
bool is_well_formed(const inertial_motion_t& motion);
SensorMotion sensor_motion_of(const inertial_motion_t& motion);

/// Empty, or what is wrong with a command's own values.
std::string why_malformed(const estimator_command_t& command);

/// Of independent errors of so much (1 sigma, each axis) in translation, m, and rotation, rad.
Matrix6d diagonal_covariance(double translation, double rotation);
void fill_measurement(const TrackingResult& measured, pose_estimate_t& estimate);
/// Also the best one as the estimate's pose.
void fill_hypotheses(const std::vector<Hypothesis>& hypotheses, pose_estimate_t& estimate);

}  // namespace berth::estimator
