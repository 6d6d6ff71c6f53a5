// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/lidar_profile.h"
#include "common/core/ray_caster.h"
#include "common/core/run_setup.h"
#include "estimator/estimator_options.h"
#include "testbed/calibration/calibration.h"
#include "testbed/node/command_planner.h"

namespace berth::procedures {

/// What is known of the rig before anything moves: layout, target and settings, read and built as
/// the nodes read and build them.
struct Rig {
  /// @throws InputError.
  explicit Rig(const RunSetup& run) : Rig(run, testbed::load_calibrated_cell(run)) {}
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  RunSetup setup;
  testbed::Calibration calibration;
  Cell cell;
  testbed::Settings settings;
  testbed::Clearance clearance;
  testbed::PathCheck path_check;
  testbed::MotionPlanner planner;
  RayCaster surface;  ///< of the target, model frame
  testbed::CommandPlanner commands;
  estimator::EstimatorOptions estimator;
  LidarProfile lidar;

  testbed::ArmPair home() const { return {cell.replica.home, cell.sensor.home}; }
  /// s from one tracking scan's start to the next one's; returns: 0 for the estimator's own number.
  double scan_period(int returns) const;
  /// s that an acquisition scans when the first look finds the target.
  double acquisition_time() const;

 private:
  Rig(const RunSetup& run, testbed::CalibratedCell calibrated);
};

}  // namespace berth::procedures
