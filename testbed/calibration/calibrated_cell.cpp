// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/config.h"
#include "common/core/sha256.h"
#include "testbed/calibration/calibration.h"

namespace berth::testbed {
namespace {

/// Resets the replica's mount to nominal: the calibration's is of another target.
void forget_mount(Calibration& calibration, const Eigen::MatrixXd& nominal) {
  constexpr int size = 6;
  const int first = parameter_index("replica.mount.x");
  calibration.values.segment<size>(first).setZero();
  calibration.covariance.middleRows<size>(first).setZero();
  calibration.covariance.middleCols<size>(first).setZero();
  calibration.covariance.block<size, size>(first, first) = nominal.block<size, size>(first, first);
  calibration.basis += ", nominal mount";
}

}  // namespace

std::filesystem::path calibration_file(const RunSetup& run) {
  return run.config / "calibration" / (run.layout + ".yaml");
}

std::string geometry_hash(const RunSetup& run) {
  const std::filesystem::path layout = run.layout_file();
  std::string hashes = sha256_of_file(layout);
  Config files = Config::load(layout);
  for (const ArmRole role : both_arms) {
    hashes += sha256_of_file(run.config / files.section(name_of(role)).text("arm"));
  }
  return sha256(hashes);
}

Calibration nominal_calibration(const RunSetup& run, const Cell& nominal) {
  const std::filesystem::path settings = run.config / "calibration.yaml";
  Calibration calibration;
  calibration.layout = run.layout;
  calibration.target = nominal.target.name;
  calibration.target_hash = nominal.target.hash;
  calibration.geometry_hash = geometry_hash(run);
  calibration.covariance = prior_covariance(nominal, load_calibration_settings(settings).nominal);
  calibration.hash = sha256(calibration.geometry_hash + sha256_of_file(settings));
  return calibration;
}

CalibratedCell load_calibrated_cell(const RunSetup& run) {
  CalibratedCell result;
  Cell nominal = load_cell(run);
  result.calibration = nominal_calibration(run, nominal);
  const std::filesystem::path file = calibration_file(run);
  if (!std::filesystem::exists(file)) {
    result.cell = std::move(nominal);
    return result;
  }
  Calibration calibration = read_calibration(file);
  if (calibration.geometry_hash != result.calibration.geometry_hash) {
    throw InputError(file.string() +
                     ": key 'geometry_hash': it was made for another layout or "
                     "other arm files than " +
                     run.layout_file().string() + " has now; calibrate again, or take it away");
  }
  if (calibration.target_hash != nominal.target.hash) {
    forget_mount(calibration, result.calibration.covariance);
  }
  result.cell = apply_calibration(nominal, calibration.values);
  result.calibration = std::move(calibration);
  return result;
}

}  // namespace berth::testbed
