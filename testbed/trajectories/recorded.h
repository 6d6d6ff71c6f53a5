// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "testbed/trajectories/trajectory.h"

namespace berth::testbed {

/// An external trajectory: comma-separated text with the columns t,x,y,z,w,p,r in s, mm and degrees
/// (T_sensor_model), in any order, named in its first line; other columns, empty lines and lines
/// that begin with '#' are ignored. Times increase; the first is taken for the start. It may begin
/// and end under way: `ramp` seconds bring it from rest and to rest.
struct TrajectoryFile {
  double ramp = 2;  ///< s; 0: it begins and ends at rest by itself
};

/// Times as in the text, the first 0; with a ramp sampled anew. name: of the file, in messages.
/// @throws InputError "NAME:LINE: ...".
Waypoints read_trajectory_text(const std::string& text, const std::string& name,
                               const TrajectoryFile& options);

/// The poses of the text unchanged, the first at 0 s; at least two. @throws InputError, as above.
Waypoints read_poses(const std::string& text, const std::string& name);
/// Text for read_poses.
std::string trajectory_text(const Waypoints& waypoints);

/// A recorded relative motion, flown again.
struct Recorded {
  Waypoints places;              ///< T_sensor_model, smoothed
  double ramp = 2;               ///< s: it may begin and end under way
  double speed = 0.05;           ///< m/s on the straight way to where it begins
  double angular_speed = 0.087;  ///< rad/s
};

/// Straight to the begin of the record, then along it at its recorded times.
Waypoints recorded(const Pose& from, const Recorded& options);

/// Smooths noisy samples: places `spacing` apart, s, each from a straight line fitted to the
/// samples within `spacing` of it. At least two.
Waypoints smoothed(const Waypoints& samples, double spacing);

}  // namespace berth::testbed
