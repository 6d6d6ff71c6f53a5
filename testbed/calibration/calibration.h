// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "common/core/run_setup.h"
#include "testbed/calibration/parameters.h"
#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

/// Residual of one kind of measurement against the calibrated cell.
struct CalibrationResidual {
  std::string kind;  ///< "scan position"
  std::int64_t count = 0;
  double rms = 0;  ///< m, rad or s
  double worst = 0;
  std::string where;  ///< of the worst
};

/// Departure of a cell from its files, with covariance. Written by `berth calibrate`, or nominal:
/// zero, with the prior's covariance.
struct Calibration {
  std::string basis = "nominal";  ///< its measurements: nominal, scans, tracker
  std::string made;               ///< UTC, "2026-11-21T21:30:00Z"; nominal: empty
  std::string layout;
  std::string target;                ///< name
  std::string target_hash;           ///< another target has another mount
  std::string geometry_hash;         ///< of the nominal layout and arm files
  std::vector<std::string> sources;  ///< the runs and tracker files that it was made from
  Eigen::VectorXd values = Eigen::VectorXd::Zero(calibration_size);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(calibration_size, calibration_size);
  std::vector<std::string> unobservable;  ///< "replica.zero.1 against base.rz", fixed by the prior
  std::vector<CalibrationResidual> residuals;
  double chi2_per_dof = 0;
  std::string hash;  ///< SHA-256 of the file; of a nominal one: of the inputs of truth

  double value(const std::string& name) const { return values[parameter_index(name)]; }
  double sigma(const std::string& name) const;
  /// True time minus the time stamped on a reading of the arm's joints, s.
  double arm_time(ArmRole role) const { return values[time_index(role)]; }
  double lidar_time() const { return values[lidar_time_index()]; }
};

/// The cell corrected by the parameters. Its kinematics take reported joints.
Cell apply_calibration(const Cell& nominal, const Eigen::VectorXd& values);

using CalibrationJacobian = Eigen::Matrix<double, 6, calibration_size>;

/// d T_sensor_model / d parameters, as perturbed() has it, at reported joints. The columns of time
/// need the joints' rates (per second); that of the LIDAR is the target's motion in that time.
/// @param calibrated result of apply_calibration
CalibrationJacobian calibration_jacobian(const Cell& calibrated, const ArmPair& joints,
                                         const ArmPair& rates = {});

/// d point in the cell / d parameters, of a point fixed to the arm's tool (m, tool frame).
using PointJacobian = Eigen::Matrix<double, 3, calibration_size>;
PointJacobian point_jacobian(const Cell& calibrated, ArmRole role, const Joints& joints,
                             const Joints& rates, const Vector3d& place);

/// Covariance of T_sensor_model due to the calibration.
Matrix6d calibration_covariance(const Cell& calibrated, const Calibration& calibration,
                                const ArmPair& joints, const ArmPair& rates = {});

/// The file's text: values and sigmas for people in mm, deg and ms, the covariance as the lower
/// triangle of its factor L (L L^T, SI units), which is exact also for nearly dependent
/// parameters.
std::string text_of(const Calibration& calibration);

/// @throws InputError when it cannot be written.
void write_calibration(const Calibration& calibration, const std::filesystem::path& file);
/// @throws InputError.
Calibration read_calibration(const std::filesystem::path& file);

/// A cell with its calibration applied.
struct CalibratedCell {
  Cell cell;  ///< takes reported joints
  Calibration calibration;
};

/// Where a run's calibration is looked for: config/calibration/<layout>.yaml.
std::filesystem::path calibration_file(const RunSetup& run);

/// SHA-256 over the layout and arm files for which a calibration is valid.
std::string geometry_hash(const RunSetup& run);

/// Of a cell without a calibration file.
Calibration nominal_calibration(const RunSetup& run, const Cell& nominal);

/// The run's cell with its calibration, or the nominal one where there is no file. With another
/// target than the calibration's the mount is the nominal one, which the basis states. @throws
/// InputError, also when the file is of another layout or other arm files.
CalibratedCell load_calibrated_cell(const RunSetup& run);

}  // namespace berth::testbed
