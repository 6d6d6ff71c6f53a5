// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/calibration/calibration.h"

namespace berth::testbed {

/// One arm at a time between two of its readings.
struct ArmMoment {
  Joints joints{};
  Joints rate{};          ///< per second
  Joints sigma{};         ///< 1 sigma of each joint by itself: encoder and interpolation
  double time_sigma = 0;  ///< s, of the time of the joints
};

/// Columns: the replica arm's joints, then the sensor arm's.
using RelativeJacobian = Eigen::Matrix<double, 6, 12>;

/// Derivative of T_sensor_model by both arms' joints; see perturbed() for its rows.
RelativeJacobian relative_jacobian(const Cell& cell, const ArmPair& joints);

/// Covariance of T_sensor_model due to the uncertainty of two readings: each joint by itself, and
/// each arm's time, which is common to all of its joints.
Matrix6d reading_covariance(const RelativeJacobian& jacobian, const ArmMoment& replica,
                            const ArmMoment& sensor);

/// Covariance of T_sensor_model due to readings and calibration: geometry and the arms' time
/// offsets, with their correlation. The geometry's part changes slowly with the joints; it is
/// computed anew when a joint has moved far enough to change it by about half a per cent.
class TruthCovariance {
 public:
  /// Both must outlive it.
  TruthCovariance(const Cell& calibrated, const Calibration& calibration);

  Matrix6d at(const ArmMoment& replica, const ArmMoment& sensor);

 private:
  using ByTime = Eigen::Matrix<double, 6, 2>;  // replica, sensor
  void update_geometry(const ArmPair& joints);
  /// Computed anew only when a joint has moved.
  const RelativeJacobian& jacobian_at(const ArmPair& joints);

  const Cell& cell_;
  const Calibration& calibration_;
  Eigen::Matrix2d time_;
  bool geometry_known_ = false;
  ArmPair geometry_at_;
  bool derived_ = false;
  ArmPair derived_at_;
  RelativeJacobian jacobian_;
  Matrix6d geometry_;
  ByTime geometry_with_time_;
};

}  // namespace berth::testbed
