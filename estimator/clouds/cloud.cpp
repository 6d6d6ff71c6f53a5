// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/clouds/cloud.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/core/beam_model.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "estimator/clouds/pcl_cloud.h"
#include "estimator/clouds/ptx_cloud.h"
#include "estimator/clouds/xyz_cloud.h"

namespace berth::estimator {

Cloud read_cloud(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool pcl = extension == ".pcd" || extension == ".ply";
  const bool xyz = extension == ".xyz" || extension == ".txt" || extension == ".csv";
  if (!pcl && !xyz && extension != ".ptx") {
    throw InputError(path.string() + ": found '" + extension +
                     "', expected a .pcd, .ply, .xyz (.txt, .csv) or .ptx cloud");
  }
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    throw InputError(path.string() + ": no such file");
  }
  if (extension == ".pcd") return read_pcd(path);
  if (extension == ".ply") return read_ply(path);
  return xyz ? parse_xyz(read_file(path), path.string())
             : parse_ptx(read_file(path), path.string());
}

void add_row(Cloud& cloud, const CloudRow& row) {
  ++cloud.counts.points;
  const double range = row.point.norm();
  constexpr double most_utime = 9e18;  // what 64 bits hold
  if (!std::isfinite(range) || !(std::abs(row.utime) < most_utime) || !std::isfinite(row.sigma)) {
    ++cloud.counts.not_finite;
    return;
  }
  if (!(range > 0)) {
    ++cloud.counts.at_sensor;
    return;
  }
  if (row.sigma < 0) {
    ++cloud.counts.bad_sigma;
    return;
  }
  RawBeam beam;
  beam.utime = std::llround(row.utime);
  beam.range = range;
  beam_angles(row.point, beam.azimuth, beam.elevation);
  beam.status = BeamStatus::hit;
  beam.range_sigma = row.sigma;
  cloud.beams.push_back(beam);
  ++cloud.counts.hits;
}

}  // namespace berth::estimator
