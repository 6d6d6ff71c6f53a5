// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/solve_runs.h"

#include <cmath>

#include "app/calibration/run_measurements.h"
#include "common/core/error.h"
#include "common/core/text.h"
#include "testbed/calibration/calibration.h"
#include "testbed/calibration/observability.h"

namespace berth {
namespace {

/// Six numbers from each: about as many as there are parameters to be found.
constexpr int min_poses = 10;

/// What truth is still uncertain by, over the poses measured.
void add_expected(SolvedCalibration& solved, const testbed::CalibrationProblem& problem) {
  const Cell cell = testbed::apply_calibration(problem.nominal, solved.calibration.values);
  double position = 0;
  double rotation = 0;
  for (const testbed::CalibrationRun& run : problem.runs) {
    for (const auto& scan : run.scans) {
      if (scan.moving) continue;
      const testbed::ArmPair joints{run.replica.at(scan.time)->joints,
                                    run.sensor.at(scan.time)->joints};
      const Matrix6d covariance = testbed::calibration_covariance(cell, solved.calibration, joints);
      position += covariance.topLeftCorner<3, 3>().trace();
      rotation += covariance.bottomRightCorner<3, 3>().trace();
    }
  }
  solved.truth_position = std::sqrt(position / static_cast<double>(solved.poses));
  solved.truth_rotation = std::sqrt(rotation / static_cast<double>(solved.poses));
}

}  // namespace

SolvedCalibration solve_runs(const std::vector<RunFiles>& runs,
                             const std::vector<std::filesystem::path>& trackers,
                             const std::string& made) {
  const RunSetup& setup = runs.front().setup;
  const TrackerSetup reflectors = load_tracker_setup(setup.config / "tracker.yaml");
  testbed::CalibrationProblem problem;
  problem.nominal = load_cell(setup);
  problem.prior = testbed::prior_covariance(
      problem.nominal,
      testbed::load_calibration_settings(setup.config / "calibration.yaml").search);
  problem.tracker_time_sigma = reflectors.time_sigma;

  SolvedCalibration solved;
  solved.prior = problem.prior;
  testbed::Calibration& calibration = solved.calibration;
  calibration.made = made;
  calibration.layout = setup.layout;
  calibration.target = problem.nominal.target.name;
  calibration.target_hash = problem.nominal.target.hash;
  calibration.geometry_hash = testbed::geometry_hash(setup);
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const RunFiles& run = runs[i];
    if (testbed::geometry_hash(run.setup) != calibration.geometry_hash ||
        run.setup.layout != setup.layout ||
        load_target(run.setup.target, run.setup.target_length).hash != calibration.target_hash) {
      throw InputError(run.directory.string() +
                       ": has another layout, other arms or another target "
                       "than " +
                       runs.front().directory.string());
    }
    problem.runs.push_back(
        read_calibration_run(run.log(), problem.nominal, reflectors, trackers[i]));
    for (std::string& pose : poses_left_out(run.log())) solved.left_out.push_back(std::move(pose));
    calibration.sources.push_back(run.name);
    if (!trackers[i].empty()) calibration.sources.push_back(trackers[i].filename().string());
    for (const auto& scan : problem.runs.back().scans)
      ++(scan.moving ? solved.moving : solved.poses);
    solved.readings += static_cast<std::int64_t>(problem.runs.back().readings.size());
  }
  if (solved.poses < min_poses) {
    throw InputError("too little to calibrate from: the target was measured at " +
                     std::to_string(solved.poses) + " poses at rest, at least " +
                     std::to_string(min_poses) + " are needed" +
                     (solved.left_out.empty() ? "" : "; left out: " + joined(solved.left_out)));
  }
  solved.solution = testbed::solve_calibration(problem);
  calibration.basis = solved.solution.with_tracker ? "tracker" : "scans";
  calibration.values = solved.solution.values;
  calibration.covariance = solved.solution.covariance;
  calibration.residuals = solved.solution.residuals;
  calibration.chi2_per_dof = solved.solution.chi2_per_dof;
  for (const auto& direction :
       testbed::find_unobservable(solved.solution.information, problem.prior)) {
    calibration.unobservable.push_back(direction.text);
  }
  add_expected(solved, problem);
  return solved;
}

}  // namespace berth
