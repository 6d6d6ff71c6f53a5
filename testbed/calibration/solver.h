// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "testbed/calibration/calibration.h"
#include "testbed/calibration/measurements.h"

namespace berth::testbed {

/// Input of the solver.
struct CalibrationProblem {
  Cell nominal;
  Eigen::MatrixXd prior;             ///< covariance of the parameters about the nominal cell
  std::vector<CalibrationRun> runs;  ///< each with its own place of the tracker
  double tracker_time_sigma = 0;     ///< s, between the trackers' clocks and the host's
};

struct CalibrationSolution {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
  Eigen::MatrixXd information;              ///< of the measurements alone
  std::vector<MeasurementResidual> before;  ///< against the nominal cell
  std::vector<MeasurementResidual> after;
  std::vector<CalibrationResidual> residuals;  ///< `after`, kind by kind
  double chi2_per_dof = 0;  ///< of measurements at rest, before their sigmas were raised
  int iterations = 0;
  bool with_tracker = false;
  /// With a tracker: mean difference of the scans from it, [m; rad] in the sensor frame.
  Vector6d scan_bias = Vector6d::Zero();
  Matrix6d scan_bias_covariance = Matrix6d::Zero();
};

/// The parameters that explain the measurements best, given the prior: Gauss-Newton with
/// Levenberg's damping, far-off measurements counted less (Huber). Where a kind of measurement
/// scatters more than its sigmas, these are raised until it does not. With tracker readings the
/// state also contains the tracker's place in each run and a constant bias of the scans, so that
/// the estimator's bias does not enter the calibration.
/// @throws InputError for too few measurements, or when it does not converge.
CalibrationSolution solve_calibration(const CalibrationProblem& problem);

}  // namespace berth::testbed
