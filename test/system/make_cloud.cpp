// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "test/common/clouds/cloud_files.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

/// make_cloud X Y Z W P R FILE...: scans of the replica in that pose (mm, degrees), as PTX where
/// the file is named so, else its returns alone as XYZ.
int main(int argc, char* argv[]) {
  if (argc < 8) return 2;
  Xyzwpr xyzwpr{};
  for (std::size_t i = 0; i < 6; ++i) xyzwpr[i] = std::atof(argv[i + 1]);
  for (int i = 7; i < argc; ++i) {
    const std::filesystem::path file = argv[i];
    ScanMaker lidar(replica().mesh, static_cast<std::uint64_t>(i));
    lidar.pose = pose_from_xyzwpr(xyzwpr);
    constexpr int columns = 110;
    constexpr int rows = 110;
    const double step = radians(40) / columns;
    std::vector<Vector3d> points;
    for (int c = 0; c < columns; ++c) {
      for (int r = 0; r < rows; ++r) {
        const RawBeam beam =
            lidar.shoot(step * (c + 0.5) - radians(20), radians(20) - step * (r + 0.5));
        const bool hit = beam.status == BeamStatus::hit;
        points.push_back(hit ? Vector3d(beam.range * beam_direction(beam.azimuth, beam.elevation))
                             : Vector3d::Zero());
      }
    }
    std::ofstream out(file);
    if (file.extension() == ".ptx") {
      out << ptx_text(points, rows);
      continue;
    }
    for (const Vector3d& p : points) {
      if (!p.isZero()) out << p.x() << " " << p.y() << " " << p.z() << "\n";
    }
  }
}
