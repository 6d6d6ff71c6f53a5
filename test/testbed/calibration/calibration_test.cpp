// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/calibration.h"

#include <filesystem>

#include "common/core/corrected_kinematics.h"
#include "common/core/file.h"
#include "common/core/random.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

namespace berth::testbed {
namespace {

const Cell& nominal_cell() {
  static const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  return cell;
}

/// A draw from the prior of a cell that is to be calibrated.
Eigen::VectorXd drawn(Random& random, double scale) {
  const auto sigmas = load_calibration_settings("config/calibration.yaml").search;
  const Eigen::MatrixXd covariance = prior_covariance(nominal_cell(), sigmas);
  Eigen::VectorXd values(calibration_size);
  for (int i = 0; i < calibration_size; ++i) {
    values[i] = random.normal(scale * std::sqrt(covariance(i, i)));
  }
  return values;
}

ArmPair drawn_joints(Random& random) {
  ArmPair joints{nominal_cell().replica.home, nominal_cell().sensor.home};
  for (Joints* arm : {&joints.replica, &joints.sensor}) {
    for (double& joint : *arm) joint += random.uniform(-0.4, 0.4);
  }
  return joints;
}

TEST_CASE("the calibration's Jacobian is that of the calibrated cell") {
  Random random(3, "calibration jacobian");
  const Eigen::VectorXd values = drawn(random, 0.01);
  const ArmPair joints = drawn_joints(random);
  const CalibrationJacobian jacobian =
      calibration_jacobian(apply_calibration(nominal_cell(), values), joints);
  constexpr double h = 1e-5;
  for (int i = 0; i < time_index(ArmRole::replica); ++i) {
    Eigen::VectorXd up = values;
    Eigen::VectorXd down = values;
    up[i] += h;
    down[i] -= h;
    const Vector6d numeric =
        difference(
            apply_calibration(nominal_cell(), down).relative_pose(joints.replica, joints.sensor),
            apply_calibration(nominal_cell(), up).relative_pose(joints.replica, joints.sensor)) /
        (2 * h);
    INFO(calibration_parameters()[static_cast<std::size_t>(i)].name);
    CHECK((jacobian.col(i) - numeric).norm() < 2e-3);
  }
}

TEST_CASE("a calibrated arm's inverse leads back to its pose") {
  Random random(5, "calibrated inverse");
  const Cell cell = apply_calibration(nominal_cell(), drawn(random, 1));
  int found = 0;
  for (int n = 0; n < 200; ++n) {
    const Joints joints = drawn_joints(random).replica;
    const Pose flange = cell.replica.kinematics->forward(joints);
    for (const InverseSolution& solution : cell.replica.kinematics->inverse(flange, nullptr)) {
      const Pose back = cell.replica.kinematics->forward(solution.joints);
      CHECK(distance(flange, back) < 1e-9);
      CHECK(angle_between(flange, back) < 1e-7);
      double away = 0;
      for (std::size_t i = 0; i < 6; ++i) {
        away = std::max(away, std::abs(solution.joints[i] - joints[i]));
      }
      found += away < 1e-6 ? 1 : 0;
    }
  }
  CHECK(found > 190);
}

TEST_CASE("a calibration file gives back what was written, whatever is unobservable") {
  TemporaryDirectory directory;
  Random random(7, "calibration file");
  Calibration calibration;
  calibration.basis = "scans";
  calibration.made = "2026-11-21T21:30:00Z";
  calibration.layout = "range";
  calibration.target = "radarsat2";
  calibration.target_hash = "ef";
  calibration.geometry_hash = "abcd";
  calibration.sources = {"run-1"};
  calibration.unobservable = {"replica.zero.1 against base.rz"};
  calibration.residuals = {{"scans, position", 60, 1e-3, 2e-3, "rest 7, S1"}};
  calibration.values = drawn(random, 1);
  calibration.covariance =
      prior_covariance(nominal_cell(), load_calibration_settings("config/calibration.yaml").search);
  // two parameters of which only the difference is known
  const int a = parameter_index("base.rz");
  const int b = parameter_index("replica.zero.1");
  calibration.covariance(a, a) = calibration.covariance(b, b) = 1e-4;
  calibration.covariance(a, b) = calibration.covariance(b, a) = 1e-4 - 1e-9;

  const auto file = directory / "calibration.yaml";
  write_calibration(calibration, file);
  const Calibration read = read_calibration(file);
  CHECK(read.basis == "scans");
  CHECK(read.unobservable == calibration.unobservable);
  CHECK(read.residuals.front().rms == Approx(1e-3));
  CHECK((read.values - calibration.values).norm() < 1e-7);
  const auto of_difference = [&](const Eigen::MatrixXd& m) {
    return m(a, a) + m(b, b) - 2 * m(a, b);
  };
  CHECK(of_difference(read.covariance) ==
        Approx(of_difference(calibration.covariance)).epsilon(0.2));
  CHECK(read.hash.size() == 64);
  CHECK(text_of(read).size() < 30000);  // goes into a log's message with the other files
}

TEST_CASE("a calibration file is read strictly") {
  TemporaryDirectory directory;
  Calibration calibration;
  calibration.basis = "scans";
  for (std::string* text : {&calibration.made, &calibration.layout, &calibration.target,
                            &calibration.target_hash, &calibration.geometry_hash}) {
    *text = "known";
  }
  const auto file = directory / "calibration.yaml";
  const std::string text = text_of(calibration);
  const auto error_of = [&](const std::string& from, const std::string& to) -> std::string {
    std::string changed = text;
    const auto at = changed.find(from);
    REQUIRE(at != std::string::npos);
    changed.replace(at, from.size(), to);
    write_file(file, changed);
    try {
      read_calibration(file);
    } catch (const InputError& e) {
      return e.what();
    }
    return "none";
  };
  CHECK(error_of("basis: scans", "basis: nominal").find("basis") != std::string::npos);
  CHECK(error_of("base.x:", "base.u:").find("base.x") != std::string::npos);
  CHECK(error_of("value: 0 mm", "value: 0 ms").find("length") != std::string::npos);
  CHECK(error_of("  - [0]", "  - [0,0]").find("row 1") != std::string::npos);
}

TEST_CASE("without a file the nominal cell is what truth rests on") {
  RunSetup run;
  run.config = "config";
  run.target = "radarsat2";
  run.layout = "free";
  const CalibratedCell calibrated = load_calibrated_cell(run);
  CHECK(calibrated.calibration.basis == "nominal");
  CHECK(calibrated.calibration.sigma("base.rz") == 0);  // no arms
  run.layout = "range";
  const CalibratedCell arms = load_calibrated_cell(run);
  CHECK(arms.calibration.sigma("base.rz") > 0);
  CHECK(arms.calibration.hash != calibrated.calibration.hash);
  const ArmPair home{arms.cell.replica.home, arms.cell.sensor.home};
  const Matrix6d covariance = calibration_covariance(arms.cell, arms.calibration, home);
  CHECK(std::sqrt(covariance(0, 0)) == Approx(1e-3).epsilon(0.5));
  CHECK(std::sqrt(covariance(3, 3)) == Approx(radians(0.02)).epsilon(0.5));
}

}  // namespace
}  // namespace berth::testbed
