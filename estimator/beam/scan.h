// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/scan_window.h"

namespace berth::estimator {

/// One beam as the LIDAR reports it.
struct RawBeam {
  std::int64_t utime = 0;  ///< us since the epoch
  double range = 0;        ///< m; 0 unless hit
  double azimuth = 0;      ///< rad, to the right
  double elevation = 0;    ///< rad, up
  BeamStatus status = BeamStatus::miss;
  double range_sigma = 0;   ///< m, where the sensor says it of each beam; 0: the beam model's
  double intensity = 0;     ///< of the return, on any scale; 0: not told
  double second_range = 0;  ///< m, of another return of the same beam; 0: there is none
  double second_range_sigma = 0;
  double second_intensity = 0;
};

/// A usable beam in the sensor frame. Of two returns of one beam each is a beam.
struct Beam {
  Vector3d direction = Vector3d::UnitZ();  ///< unit
  double range = 0;                        ///< m; infinity when nothing came back
  std::int64_t utime = 0;
  double range_sigma = 0;  ///< m; 0: the beam model's
  double intensity = 0;    ///< of the return, on any scale; 0: not told

  bool hit() const { return range < std::numeric_limits<double>::infinity(); }
  Vector3d point() const { return direction * range; }
};

/// The interval of ranges in which the target may be, m.
struct RangeGate {
  double near = 0;
  double far = std::numeric_limits<double>::infinity();
  bool contains(double range) const { return range >= near && range <= far; }
};

/// A scan after the paper's first step (section 4.1): filtered and Cartesian.
struct CleanScan {
  std::vector<Beam> beams;       ///< all that say anything: hits, and beams that met nothing
  std::vector<Vector3d> points;  ///< hits inside the gate, m, sensor frame
  std::vector<std::uint32_t> beam_of_point;  ///< index into beams

  // Where every beam went: received = beams.size() + invalid + saturated + too_near + repeated.
  int received = 0;
  int misses = 0;   ///< nothing came back, or from too far: free space; all are in beams
  int nearer = 0;   ///< hits before the gate: occluders
  int farther = 0;  ///< hits behind the gate: free space up to there
  int invalid = 0;  ///< range or angle not finite, not positive, or beyond the instrument
  int saturated = 0;
  int too_near = 0;
  int repeated = 0;  ///< direction and range of one before, to the last bit: it says nothing new

  std::int64_t utime_first = 0;  ///< of the points; 0 without any
  std::int64_t utime_last = 0;
  std::int64_t utime_mean = 0;
};

/// Filters by status and range gate and converts to Cartesian coordinates. Misses and returns from
/// behind the gate stay as evidence of free space. Of beams that are identical the first counts:
/// noise does not repeat itself, senders do (dual returns, merged files). Second returns count
/// where the beam model says that the scanner tells them. No input is an error.
CleanScan preprocess(const std::vector<RawBeam>& scan, const RangeGate& gate,
                     const BeamModel& beam_model);

/// A scan of a target that moves with this velocity about its origin (m, sensor frame), as if all
/// of it had been seen at the scan's mean time: returns, and beams that met nothing as far as the
/// origin is. For methods that take a scan to be of one time.
CleanScan at_mean_time(const CleanScan& scan, const Velocity& velocity, const Vector3d& origin);

}  // namespace berth::estimator
