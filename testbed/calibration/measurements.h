// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/cell.h"
#include "testbed/calibration/calibration.h"
#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

/// The reported joints of one arm over a run.
class JointTrack {
 public:
  /// In order of time; others are dropped.
  void add(double t, const Joints& joints);
  struct State {
    Joints joints{};
    Joints rates{};  ///< per second
  };
  /// Between two readings, at most 0.1 s apart; nothing elsewhere.
  std::optional<State> at(double t) const;
  bool empty() const { return times_.empty(); }

 private:
  std::vector<double> times_;
  std::vector<Joints> joints_;
};

/// Measurements of a run for calibration. Stamped times, s from a common origin.
struct CalibrationRun {
  JointTrack replica;
  JointTrack sensor;

  /// Pose of the target as estimated from a scan.
  struct Scan {
    std::string where;  ///< "pose 7"
    double time = 0;
    Pose pose;            ///< T_sensor_model
    Matrix6d covariance;  ///< see perturbed()
    bool moving = false;
  };
  std::vector<Scan> scans;

  /// Position of a reflector as measured by a tracker.
  struct Reading {
    std::string where;
    double time = 0;
    ArmRole on = ArmRole::replica;
    Vector3d place;    ///< of the reflector, in the model or the sensor frame
    Vector3d point;    ///< m, in the tracker's frame
    double sigma = 0;  ///< m per axis
    bool moving = false;
  };
  std::vector<Reading> readings;

  const JointTrack& arm(ArmRole role) const { return role == ArmRole::replica ? replica : sensor; }
};

/// Residual of one measurement against a cell.
struct MeasurementResidual {
  std::string kind;                ///< "scans", "tracker in motion"
  std::string where;               ///< "pose 7"
  double position = 0;             ///< m
  std::optional<double> attitude;  ///< rad; a point has none
};

/// One residual for each kind, in order of appearance, position and attitude apart.
std::vector<CalibrationResidual> summarised(const std::vector<MeasurementResidual>& residuals);

/// T_tracker_cell by a least-squares alignment of the run's readings with the cell's reflectors
/// (Umeyama 1991); the identity for fewer than three readings.
Pose place_tracker(const Cell& cell, const CalibrationRun& run);

}  // namespace berth::testbed
