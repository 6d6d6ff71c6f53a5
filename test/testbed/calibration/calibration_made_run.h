// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "common/core/random.h"
#include "common/core/reflectors.h"
#include "testbed/calibration/solver.h"

namespace berth::testbed {

/// A made-up cell that is wrong by known parameters, and what would be measured in it.
class MadeWorld {
 public:
  MadeWorld(std::uint64_t seed, double size)
      : nominal(load_cell("config/layouts/range.yaml", load_target("radarsat2", 0))),
        prior(
            prior_covariance(nominal, load_calibration_settings("config/calibration.yaml").search)),
        random(seed, "made world") {
    values.resize(calibration_size);
    for (int i = 0; i < calibration_size; ++i) {
      values[i] = random.normal(size * std::sqrt(prior(i, i)));
    }
    values[lidar_time_index()] = 0;
    world = apply_calibration(nominal, values);
  }

  ArmPair configuration() {
    ArmPair joints{nominal.replica.home, nominal.sensor.home};
    for (Joints* arm : {&joints.replica, &joints.sensor}) {
      for (double& joint : *arm) joint += random.uniform(-0.5, 0.5);
    }
    return joints;
  }

  Pose measured(const Pose& truth, double position, double rotation) {
    Vector6d off;
    off << random.normal_vector(position), random.normal_vector(rotation);
    return perturbed(truth, off);
  }

  /// Scans at rest, 10 s apart, then scans while the joints swing.
  CalibrationRun run(int poses, int moving, double position, double rotation,
                     const Vector6d& bias = Vector6d::Zero()) {
    CalibrationRun run;
    Matrix6d covariance = Matrix6d::Zero();
    covariance.diagonal().head<3>().setConstant(position * position);
    covariance.diagonal().tail<3>().setConstant(rotation * rotation);
    double t = 0;
    for (int i = 0; i < poses; ++i, t += 10) {
      const ArmPair joints = configuration();
      add_rest(run, t, joints);
      const Pose truth = world.relative_pose(joints.replica, joints.sensor);
      run.scans.push_back({"pose " + std::to_string(i + 1), t,
                           measured(perturbed(truth, bias), position, rotation), covariance,
                           false});
    }
    const ArmPair middle{nominal.replica.home, nominal.sensor.home};
    const auto swing = [&](ArmRole role, double at) {
      Joints joints = middle.of(role);
      const double phase = role == ArmRole::replica ? 0 : 1.3;
      for (double& joint : joints) joint += 0.1 * std::sin(1.5 * at + phase);
      return joints;
    };
    const double begin = t;
    for (; t < begin + moving; t += 0.01) {
      // stamped earlier than it was by the arm's offset
      for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
        (role == ArmRole::replica ? run.replica : run.sensor)
            .add(t - values[time_index(role)], swing(role, t));
      }
    }
    for (int i = 1; i + 1 < moving; ++i) {
      const double at = begin + i + random.uniform(0, 0.5);
      const Pose truth =
          world.relative_pose(swing(ArmRole::replica, at), swing(ArmRole::sensor, at));
      run.scans.push_back(
          {"stroke", at, measured(perturbed(truth, bias), position, rotation), covariance, true});
    }
    return run;
  }

  /// What a tracker sees of the reflectors during the run's scans.
  void add_readings(CalibrationRun& run, const TrackerSetup& setup, const Pose& tracker_cell) {
    for (const auto& scan : run.scans) {
      for (const Reflector& reflector : setup.reflectors) {
        const auto at = run.arm(reflector.on).at(scan.time - values[time_index(reflector.on)]);
        if (!at) continue;
        const Vector3d point =
            tracker_cell * (world.arm(reflector.on).tool_pose(at->joints) * reflector.place);
        const double sigma = setup.sigma_at(point.norm());
        run.readings.push_back({scan.where, scan.time, reflector.on, reflector.place,
                                point + random.normal_vector(sigma), sigma, scan.moving});
      }
    }
  }

  struct Error {
    double position = 0;  ///< m, median
    double rotation = 0;  ///< rad
  };
  /// Of truth by a solution, at configurations it does not know.
  Error error_of(const Eigen::VectorXd& solved) {
    const Cell cell = apply_calibration(nominal, solved);
    std::vector<double> position;
    std::vector<double> rotation;
    for (int i = 0; i < 201; ++i) {
      const ArmPair joints = configuration();
      const Pose truth = world.relative_pose(joints.replica, joints.sensor);
      const Pose modelled = cell.relative_pose(joints.replica, joints.sensor);
      position.push_back(distance(truth, modelled));
      rotation.push_back(angle_between(truth, modelled));
    }
    std::nth_element(position.begin(), position.begin() + 100, position.end());
    std::nth_element(rotation.begin(), rotation.begin() + 100, rotation.end());
    return {position[100], rotation[100]};
  }

  Cell nominal;
  Cell world;
  Eigen::MatrixXd prior;
  Eigen::VectorXd values;
  Random random;

 private:
  static void add_rest(CalibrationRun& run, double t, const ArmPair& joints) {
    for (const double at :
         {t - 0.2, t - 0.15, t - 0.1, t - 0.05, t, t + 0.05, t + 0.1, t + 0.15, t + 0.2}) {
      run.replica.add(at, joints.replica);
      run.sensor.add(at, joints.sensor);
    }
  }
};

}  // namespace berth::testbed
