// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/pose.h"

namespace berth::clouds {

/// How the points of a file were used: `points` is the sum of all others.
struct CloudCounts {
  std::size_t points = 0;  ///< rows of the file, empty beams included
  std::size_t hits = 0;
  std::size_t misses = 0;         ///< empty beams whose direction follows from the file's grid
  std::size_t undirected = 0;     ///< empty beams of unknown direction: dropped
  std::size_t not_finite = 0;     ///< a coordinate that is missing or no number: dropped
  std::size_t at_sensor = 0;      ///< range zero: dropped
  std::size_t later_returns = 0;  ///< not the first of their beam (return_number > 1): dropped
};

/// One beam, as far as a cloud file has it.
struct CloudBeam {
  std::int64_t utime = 0;  ///< us; 0 where the file has no times
  bool hit = false;        ///< else nothing came back
  double range = 0;        ///< m; 0 unless hit
  double azimuth = 0;      ///< rad, to the right
  double elevation = 0;    ///< rad, up
  double range_sigma = 0;  ///< m; 0: unknown
};

/// A cloud file as the beams that made it. Sensor frame, m.
struct Cloud {
  std::vector<CloudBeam> beams;  ///< hits and misses, in the file's order
  CloudCounts counts;
  bool has_misses = false;  ///< the format has empty beams
  bool has_times = false;   ///< else the scan is taken to be of one time
  bool has_sigmas = false;
  std::vector<std::string> notes;  ///< remarks for the user on how the file was read
};

/// Options for information that files lack.
struct CloudOptions {
  std::optional<double> us_per_time;  ///< unit of its times, overrides name and magnitude
};

/// Reads a cloud by its extension. A file is read whole or refused.
/// - PCD: fields x y z; text, binary, compressed. PLY: properties x y z of its vertices.
/// - XYZ, TXT, CSV, ASC, PTS: a point a line; x y z first, or columns that a header names.
/// - PTX: one scan; beams at 0 0 0 are misses.
/// A time and a range sigma (sigma, m) are used where a field or column is named so; the unit of
/// time is found from its name, else from the values' magnitude. Times that cannot be used leave
/// the scan without times, with a note; they never discard a point.
/// @throws InputError naming file, for text also the line, what was found and what was expected.
Cloud read_cloud(const std::filesystem::path& path, const CloudOptions& options = {});
/// The same of a file's bytes. extension: as ".xyz", in lower case; file: its name, for messages.
Cloud parse_cloud(std::string bytes, const std::string& extension, const std::string& file,
                  const CloudOptions& options = {});

/// Whether a file's extension is one that read_cloud knows.
bool is_cloud(const std::filesystem::path& path);
/// ".pcd, .ply, ...", for messages.
std::string known_extensions();

}  // namespace berth::clouds
