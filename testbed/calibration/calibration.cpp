// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/calibration.h"

#include <cmath>

#include "common/core/corrected_kinematics.h"

namespace berth::testbed {
namespace {

/// Places of an arm's parameters.
struct ArmIndex {
  int mount;
  int zero;
  int a;
  int d;
  int alpha;
  int beta;

  explicit ArmIndex(ArmRole role)
      : mount(role == ArmRole::replica ? 6 : 33),
        zero(mount + 6),
        a(zero + 6),
        d(a + 5),
        alpha(d + 4),
        beta(alpha + 5) {}
};
constexpr int adjusted_links = 5;
constexpr int tilted_link = 2;

/// Place of d of a link (1..5) among the arm's; -1: none.
int d_place(int link) { return link == 1 ? 0 : link == 2 ? -1 : link - 2; }

Pose pose_of(const Eigen::VectorXd& values, int first) {
  return {values.segment<3>(first), rotation_from_vector(values.segment<3>(first + 3))};
}

KinematicCorrections corrections_of(const ArmKinematics& nominal, const ArmIndex& index,
                                    const Eigen::VectorXd& values) {
  KinematicCorrections corrections;
  const auto links = nominal.link_poses({});
  for (std::size_t i = 0; i < 6; ++i)
    corrections.zero[i] = values[index.zero + static_cast<int>(i)];
  for (int link = 1; link <= adjusted_links; ++link) {
    const auto i = static_cast<std::size_t>(link);
    // the axis of the joint that turns the link: always the same, seen from the link
    const Vector3d axis =
        links[i].rotation.conjugate() * (links[i - 1].rotation * Vector3d::UnitZ());
    Pose& correction = corrections.links[i - 1];
    correction.position = values[index.a + link - 1] * Vector3d::UnitX();
    if (d_place(link) >= 0) correction.position += values[index.d + d_place(link)] * axis;
    correction.rotation = rotation_from_vector(values[index.alpha + link - 1] * Vector3d::UnitX());
    if (link == tilted_link) {
      correction.rotation =
          correction.rotation * rotation_from_vector(values[index.beta] * Vector3d::UnitY());
    }
  }
  return corrections;
}

/// Twists of the model in the cell frame, one column per parameter.
class Columns {
 public:
  Columns(CalibrationJacobian& jacobian, const Pose& sensor, const Vector3d& model, double sign)
      : jacobian_(jacobian),
        to_sensor_(sensor.rotation.conjugate().toRotationMatrix()),
        model_(model),
        sign_(sign) {}

  void shift(int column, const Vector3d& direction) { set(column, direction, Vector3d::Zero()); }
  void turn(int column, const Vector3d& axis, const Vector3d& through) {
    set(column, axis.cross(model_ - through), axis);
  }
  void pose(int first, const Pose& frame) {
    for (int i = 0; i < 3; ++i) {
      const Vector3d axis = frame.rotation * Vector3d::Unit(i);
      shift(first + i, axis);
      turn(first + 3 + i, axis, frame.position);
    }
  }
  void set(int column, const Vector3d& linear, const Vector3d& angular) {
    jacobian_.col(column) << sign_ * (to_sensor_ * linear), sign_ * (to_sensor_ * angular);
  }

 private:
  CalibrationJacobian& jacobian_;
  Matrix3d to_sensor_;
  Vector3d model_;
  double sign_;
};

void add_arm(const PlacedArm& arm, const Joints& joints, const Joints& rates, Columns& columns,
             const Vector3d& model) {
  const ArmIndex index(arm.role);
  const auto links = arm.kinematics->link_poses(joints);
  const Pose flange = arm.base * links[6];
  columns.pose(index.mount, flange * arm.tool);
  for (int link = 1; link <= adjusted_links; ++link) {
    const auto i = static_cast<std::size_t>(link);
    const Pose frame = arm.base * links[i];
    const Vector3d x = frame.rotation * Vector3d::UnitX();
    columns.shift(index.a + link - 1, x);
    columns.turn(index.alpha + link - 1, x, frame.position);
    if (d_place(link) >= 0) {
      columns.shift(index.d + d_place(link),
                    arm.base.rotation * (links[i - 1].rotation * Vector3d::UnitZ()));
    }
    if (link == tilted_link) {
      columns.turn(index.beta, frame.rotation * Vector3d::UnitY(), frame.position);
    }
  }
  const Matrix6d by_joints = arm.kinematics->jacobian(joints);
  Vector6d rate;  // of the model with the arm, cell frame
  rate.setZero();
  for (int i = 0; i < 6; ++i) {
    const Vector3d angular = arm.base.rotation * by_joints.block<3, 1>(3, i);
    const Vector3d linear =
        arm.base.rotation * by_joints.block<3, 1>(0, i) + angular.cross(model - flange.position);
    columns.set(index.zero + i, -linear, -angular);
    const double speed = rates[static_cast<std::size_t>(i)];
    rate.head<3>() += speed * linear;
    rate.tail<3>() += speed * angular;
  }
  // an offset shifts readings to later times: at a given time the arm is at an earlier place
  columns.set(time_index(arm.role), -rate.head<3>(), -rate.tail<3>());
}

}  // namespace

double Calibration::sigma(const std::string& name) const {
  const int i = parameter_index(name);
  return std::sqrt(covariance(i, i));
}

Cell apply_calibration(const Cell& nominal, const Eigen::VectorXd& values) {
  Cell cell = nominal;
  cell.replica.base = nominal.replica.base * pose_of(values, 0);
  for (PlacedArm* arm : {&cell.replica, &cell.sensor}) {
    const ArmIndex index(arm->role);
    arm->tool = arm->tool * pose_of(values, index.mount);
    if (values.segment(index.zero, index.beta + 1 - index.zero).isZero(0)) continue;
    arm->kinematics = std::make_shared<CorrectedKinematics>(
        arm->kinematics, corrections_of(*arm->kinematics, index, values));
  }
  return cell;
}

CalibrationJacobian calibration_jacobian(const Cell& calibrated, const ArmPair& joints,
                                         const ArmPair& rates) {
  CalibrationJacobian jacobian;
  jacobian.setZero();
  const Pose sensor = calibrated.sensor.tool_pose(joints.sensor);
  const Vector3d model = calibrated.replica.tool_pose(joints.replica).position;
  Columns by_replica(jacobian, sensor, model, 1);
  by_replica.pose(0, calibrated.replica.base);
  add_arm(calibrated.replica, joints.replica, rates.replica, by_replica, model);
  // The sensor arm moves the model in the sensor frame as if the model moved the other way with it.
  Columns by_sensor(jacobian, sensor, model, -1);
  add_arm(calibrated.sensor, joints.sensor, rates.sensor, by_sensor, model);
  jacobian.col(lidar_time_index()) =
      -jacobian.col(time_index(ArmRole::replica)) - jacobian.col(time_index(ArmRole::sensor));
  return jacobian;
}

PointJacobian point_jacobian(const Cell& calibrated, ArmRole role, const Joints& joints,
                             const Joints& rates, const Vector3d& place) {
  CalibrationJacobian jacobian;
  jacobian.setZero();
  const PlacedArm& arm = calibrated.arm(role);
  const Vector3d point = arm.tool_pose(joints) * place;
  Columns columns(jacobian, Pose{}, point, 1);
  if (role == ArmRole::replica) columns.pose(0, arm.base);
  add_arm(arm, joints, rates, columns, point);
  return jacobian.topRows<3>();
}

Matrix6d calibration_covariance(const Cell& calibrated, const Calibration& calibration,
                                const ArmPair& joints, const ArmPair& rates) {
  CalibrationJacobian jacobian = calibration_jacobian(calibrated, joints, rates);
  jacobian.col(lidar_time_index()).setZero();  // it shifts the time of a scan, not the target
  return jacobian * calibration.covariance * jacobian.transpose();
}

}  // namespace berth::testbed
