// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// The lines between a PTX file's counts and its beams, at rest.
inline const std::string ptx_poses =
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";

/// A scan in PTX; points column by column, zero where nothing came back.
inline std::string ptx_text(const std::vector<Vector3d>& points, std::size_t rows) {
  std::string text = std::to_string(points.size() / rows) + "\n" + std::to_string(rows) + "\n";
  text += ptx_poses;
  char line[100];
  for (const Vector3d& p : points) {
    std::snprintf(line, sizeof line, "%.6f %.6f %.6f 0.5\n", p.x(), p.y(), p.z());
    text += line;
  }
  return text;
}

}  // namespace berth::estimator
