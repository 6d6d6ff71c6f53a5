// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "testbed/trajectories/trajectory.h"

namespace berth::testbed {

/// A trajectory of somebody else's: comma-separated text with the columns t,x,y,z,w,p,r in s, mm
/// and degrees (T_sensor_model), in any order, named in its first line; other columns are passed
/// over, and so are empty lines and lines that begin with '#'. Times increase; the first is taken
/// for the start. It may begin and end under way: `ramp` seconds bring it from rest and to rest.
struct TrajectoryFile {
  double ramp = 2;  ///< s; 0: it begins and ends at rest by itself
};

/// Times as in the file, the first 0; with a ramp sampled anew.
/// @throws InputError "FILE:LINE: ...".
Waypoints read_trajectory_file(const std::filesystem::path& file, const TrajectoryFile& options);
/// The same from text; name stands in for the file in messages.
Waypoints read_trajectory_text(const std::string& text, const std::string& name,
                               const TrajectoryFile& options);

}  // namespace berth::testbed
