// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/core/pose.h"

namespace berth::clouds {

/// Where every point of a file went: points is the sum of all others.
struct CloudCounts {
  std::size_t points = 0;  ///< rows of the file, empty beams included
  std::size_t hits = 0;
  std::size_t misses = 0;      ///< empty beams whose direction the file's grid tells
  std::size_t undirected = 0;  ///< empty beams whose direction nothing tells: dropped
  std::size_t not_finite = 0;  ///< a coordinate, time or sigma that is no number: dropped
  std::size_t at_sensor = 0;   ///< range zero: dropped
  std::size_t bad_sigma = 0;   ///< negative: dropped
};

/// One beam, as far as a cloud tells it.
struct CloudBeam {
  std::int64_t utime = 0;  ///< us; 0 where the file has no times
  bool hit = false;        ///< else nothing came back
  double range = 0;        ///< m; 0 unless hit
  double azimuth = 0;      ///< rad, to the right
  double elevation = 0;    ///< rad, up
  double range_sigma = 0;  ///< m; 0: not said
};

/// A cloud file as the beams that made it. Sensor frame, m.
struct Cloud {
  std::vector<CloudBeam> beams;  ///< hits and misses, in the file's order
  CloudCounts counts;
  bool has_misses = false;  ///< the format tells empty beams
  bool has_times = false;
  bool has_sigmas = false;
  std::vector<std::string> notes;  ///< what a user should know of how the file was read
};

/// Reads a cloud by its extension:
/// - PCD, PLY: fields x y z; optional time or timestamp (s), utime or time_us (us), sigma (m).
/// - XYZ, TXT, CSV: a point a line, columns x y z and others; a header line or comment that names
///   the columns makes the optional ones known.
/// - PTX: one scan; beams at 0 0 0 are misses.
/// @throws InputError naming file, for text also the line, what was found and what was expected.
Cloud read_cloud(const std::filesystem::path& path);

/// Whether a file's extension is one that read_cloud knows.
bool is_cloud(const std::filesystem::path& path);
/// ".pcd, .ply, ...", for messages.
std::string known_extensions();

/// One row of a cloud.
struct CloudRow {
  Vector3d point = Vector3d::Zero();  ///< m
  double utime = 0;                   ///< us
  double sigma = 0;                   ///< m; 0: not said
};

/// Takes a row in as a hit, or counts why not.
void add_row(Cloud& cloud, const CloudRow& row);

}  // namespace berth::clouds
