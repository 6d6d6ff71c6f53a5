// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "common/core/reflectors.h"

namespace berth::testbed {

/// One line of a tracker's file.
struct TrackerLine {
  double time = 0;            ///< s since the epoch
  std::size_t reflector = 0;  ///< of the setup
  Vector3d point;             ///< m, tracker's frame
};

/// Reads a tracker's CSV: a header that names the columns, among them time (s since the epoch, as
/// the host counts it), point (the reflector's name), x, y, z (mm); others are ignored, except w, p
/// and r, which are an error because they would have no effect. Empty lines and lines that begin
/// with # are skipped.
/// @throws InputError naming file and line.
std::vector<TrackerLine> parse_tracker_file(std::string_view text, const std::string& name,
                                            const TrackerSetup& setup);
std::vector<TrackerLine> read_tracker_file(const std::filesystem::path& file,
                                           const TrackerSetup& setup);

}  // namespace berth::testbed
