// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/truth/truth_covariance.h"

namespace berth::testbed {
namespace {

using Map = Eigen::Map<const Vector6d>;

constexpr double same_place = 0.005;  // rad, of linear axes m

/// Jacobian of a point that an arm holds, cell frame, by the arm's joints.
/// @param flange where they put it, in the cell
Matrix6d point_jacobian(const PlacedArm& arm, const Joints& joints, const Pose& flange,
                        const Vector3d& point) {
  const Matrix3d to_cell = arm.base.rotation.toRotationMatrix();
  const Matrix6d in_base = arm.kinematics->jacobian(joints);
  Matrix6d jacobian;
  jacobian.bottomRows<3>().noalias() = to_cell * in_base.bottomRows<3>();
  jacobian.topRows<3>() =
      to_cell * in_base.topRows<3>() - skew(point - flange.position) * jacobian.bottomRows<3>();
  return jacobian;
}

}  // namespace

RelativeJacobian relative_jacobian(const Cell& cell, const ArmPair& joints) {
  const auto flange_of = [](const PlacedArm& arm, const Joints& at) {
    return arm.base * arm.kinematics->forward(at);
  };
  const Pose replica_flange = flange_of(cell.replica, joints.replica);
  const Pose sensor_flange = flange_of(cell.sensor, joints.sensor);
  const Vector3d model = (replica_flange * cell.replica.tool).position;
  RelativeJacobian in_cell;
  in_cell.leftCols<6>() = point_jacobian(cell.replica, joints.replica, replica_flange, model);
  // The sensor arm moves the model in the sensor frame as if the model moved the other way with it.
  in_cell.rightCols<6>() = -point_jacobian(cell.sensor, joints.sensor, sensor_flange, model);
  const Matrix3d to_sensor =
      (sensor_flange * cell.sensor.tool).rotation.conjugate().toRotationMatrix();
  RelativeJacobian jacobian;
  jacobian.topRows<3>().noalias() = to_sensor * in_cell.topRows<3>();
  jacobian.bottomRows<3>().noalias() = to_sensor * in_cell.bottomRows<3>();
  return jacobian;
}

Matrix6d reading_covariance(const RelativeJacobian& jacobian, const ArmMoment& replica,
                            const ArmMoment& sensor) {
  Eigen::Matrix<double, 12, 1> sigma;
  sigma << Map(replica.sigma.data()), Map(sensor.sigma.data());
  const RelativeJacobian scaled = jacobian * sigma.asDiagonal();
  const Vector6d late_replica =
      replica.time_sigma * (jacobian.leftCols<6>() * Map(replica.rate.data()));
  const Vector6d late_sensor =
      sensor.time_sigma * (jacobian.rightCols<6>() * Map(sensor.rate.data()));
  Matrix6d covariance;
  covariance.noalias() = scaled * scaled.transpose();
  covariance.noalias() += late_replica * late_replica.transpose();
  covariance.noalias() += late_sensor * late_sensor.transpose();
  return covariance;
}

TruthCovariance::TruthCovariance(const Cell& calibrated, const Calibration& calibration)
    : cell_(calibrated), calibration_(calibration) {
  const int places[] = {time_index(ArmRole::replica), time_index(ArmRole::sensor)};
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      time_(row, column) = calibration.covariance(places[row], places[column]);
    }
  }
}

void TruthCovariance::update_geometry(const ArmPair& joints) {
  if (geometry_known_ && max_change(geometry_at_, joints) < same_place) return;
  geometry_known_ = true;
  geometry_at_ = joints;
  CalibrationJacobian jacobian = calibration_jacobian(cell_, joints);
  jacobian.col(lidar_time_index()).setZero();  // shifts the time of a scan, not the target
  const Eigen::Matrix<double, 6, calibration_size> spread = jacobian * calibration_.covariance;
  geometry_.noalias() = spread * jacobian.transpose();
  geometry_with_time_ << spread.col(time_index(ArmRole::replica)),
      spread.col(time_index(ArmRole::sensor));
}

const RelativeJacobian& TruthCovariance::jacobian_at(const ArmPair& joints) {
  const bool same =
      derived_ && joints.replica == derived_at_.replica && joints.sensor == derived_at_.sensor;
  if (same) return jacobian_;
  derived_ = true;
  derived_at_ = joints;
  return jacobian_ = relative_jacobian(cell_, joints);
}

Matrix6d TruthCovariance::at(const ArmMoment& replica, const ArmMoment& sensor) {
  const ArmPair joints{replica.joints, sensor.joints};
  update_geometry(joints);
  const RelativeJacobian& jacobian = jacobian_at(joints);
  // an offset shifts readings to later times: at a given time the arm is at an earlier place
  ByTime by_time;
  by_time << -jacobian.leftCols<6>() * Map(replica.rate.data()),
      -jacobian.rightCols<6>() * Map(sensor.rate.data());
  const Matrix6d mixed = geometry_with_time_ * by_time.transpose();
  return geometry_ + mixed + mixed.transpose() + by_time * time_ * by_time.transpose() +
         reading_covariance(jacobian, replica, sensor);
}

}  // namespace berth::testbed
