// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/check/rig.h"

namespace berth::procedures {

Rig::Rig(const RunSetup& run, testbed::CalibratedCell calibrated)
    : setup(run),
      calibration(std::move(calibrated.calibration)),
      cell(std::move(calibrated.cell)),
      settings(testbed::load_settings(run.config / "testbed.yaml", cell)),
      clearance(cell, settings.clearance),
      path_check(cell, settings.path, clearance),
      planner(cell, path_check, clearance),
      surface(cell.target.mesh),
      commands(cell, settings, planner, surface),
      estimator(estimator::load_estimator_options(run.config / "estimator.yaml")),
      lidar(load_lidar_profile(run, estimator.lidar)) {}

double Rig::scan_period(int returns) const {
  const int beams = returns > 0 ? returns : estimator.returns_per_scan;
  return beams / lidar.rate_hz + estimator.request_latency_s;
}

double Rig::acquisition_time() const {
  return (estimator.acquire_beams + estimator.zoom_beams) / lidar.rate_hz +
         2 * estimator.request_latency_s;
}

}  // namespace berth::procedures
