// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/lidar_profile.h"

namespace berth::estimator {

/// One beam as reported by the LIDAR.
struct RawBeam {
  std::int64_t utime = 0;  ///< us since the epoch
  double range = 0;        ///< m; 0 unless hit
  double azimuth = 0;      ///< rad, to the right
  double elevation = 0;    ///< rad, up
  BeamStatus status = BeamStatus::miss;
  double range_sigma = 0;   ///< m; 0: the beam model's
  double intensity = 0;     ///< of the return, on any scale; 0: unknown
  double second_range = 0;  ///< m, of a second return of the same beam; 0: none
  double second_range_sigma = 0;
  double second_intensity = 0;
};

/// A usable beam in the sensor frame. Two returns of one beam are two beams.
struct Beam {
  Vector3d direction = Vector3d::UnitZ();  ///< unit
  double range = 0;                        ///< m; infinity: no return
  std::int64_t utime = 0;
  double range_sigma = 0;  ///< m; 0: the beam model's
  double intensity = 0;    ///< of the return, on any scale; 0: unknown

  bool hit() const { return range < std::numeric_limits<double>::infinity(); }
  Vector3d point() const { return direction * range; }
};

/// The interval of ranges in which the target may be, m.
struct RangeGate {
  double near = 0;
  double far = std::numeric_limits<double>::infinity();
  bool contains(double range) const { return range >= near && range <= far; }
};

/// A scan after the paper's first step (section 4.1): filtered and in Cartesian coordinates.
struct PreprocessedScan {
  std::vector<Beam> beams;                   ///< returns and beams without return
  std::vector<Vector3d> points;              ///< returns inside the gate, m, sensor frame
  std::vector<std::uint32_t> beam_of_point;  ///< index into beams

  // received = beams.size() + invalid + saturated + too_near + repeated.
  int received = 0;
  int misses = 0;   ///< no return, or one beyond the scanner's range: free space; all are in beams
  int nearer = 0;   ///< returns before the gate: occluders
  int farther = 0;  ///< returns behind the gate: free space up to them
  int invalid = 0;  ///< range or angle not finite, not positive, or beyond the scanner's range
  int saturated = 0;
  int too_near = 0;
  int repeated = 0;  ///< direction and range equal to an earlier beam's, to the last bit

  std::int64_t utime_first = 0;  ///< of the points; 0 without any
  std::int64_t utime_last = 0;
  std::int64_t utime_mean = 0;
};

/// Filters by status and range gate and converts to Cartesian coordinates. Beams without return and
/// returns behind the gate are kept as evidence of free space. Of identical beams the first is
/// kept: noise does not repeat, duplicates come from senders (merged files). Second returns are
/// used where the beam model has them. Any input is valid.
PreprocessedScan preprocess(const std::vector<RawBeam>& scan, const RangeGate& gate,
                            const BeamModel& beam_model);

/// Motion compensation: the scan of a target that moves with this velocity about its origin (m,
/// sensor frame), as if taken at the scan's mean time. Beams without return are moved at the range
/// of the origin. For methods that assume one time.
PreprocessedScan at_mean_time(const PreprocessedScan& scan, const Velocity& velocity,
                              const Vector3d& origin);

}  // namespace berth::estimator
