// SPDX-License-Identifier: BSD-3-Clause
#include "app/commands/estimate_hints.h"

#include <algorithm>
#include <limits>

#include "common/core/text.h"

namespace berth::commands {

namespace {

using Status = estimator::SingleScanResult::Status;

/// "900 of 921 have ..., 21 are at ..." and how many in all.
struct Drops {
  std::size_t points;
  std::string text;
  std::size_t count = 0;

  Drops(const clouds::CloudCounts& file, const estimator::PreprocessedScan& scan)
      : points(file.points) {
    add(file.not_finite, "have a coordinate that is missing or no number");
    add(file.at_sensor, "are at the sensor (0 0 0)");
    add(file.later_returns, "are later returns of their beams");
    add(file.undirected, "are empty beams without a direction");
    add(static_cast<std::size_t>(scan.invalid), "are farther than 100 km");
    add(static_cast<std::size_t>(scan.nearer), "are nearer than the gate");
    add(static_cast<std::size_t>(scan.farther), "are farther than the gate");
  }

 private:
  void add(std::size_t dropped, const char* why) {
    if (dropped == 0) return;
    const std::string of = text.empty() ? " of " + std::to_string(points) : "";
    text += (text.empty() ? "" : ", ") + std::to_string(dropped) + of + " " + why;
    count += dropped;
  }
};

void explain_drops(const clouds::Cloud& cloud, const estimator::PreprocessedScan& scan,
                   estimator::SingleScanResult& result) {
  const Drops drops(cloud.counts, scan);
  if (result.status == Status::ok || drops.count == 0) return;
  if (drops.count + cloud.counts.misses == drops.points) {
    result.reason = "every point dropped: " + drops.text;
  } else if (2 * drops.count > drops.points) {
    result.reason += "; most points were dropped: " + drops.text;
  }
}

/// The returns of a cloud, gate or not.
struct Extent {
  Vector3d min_corner = Vector3d::Constant(std::numeric_limits<double>::infinity());
  Vector3d max_corner = -min_corner;
  double nearest = std::numeric_limits<double>::infinity();
  double farthest = 0;
  std::size_t within = 0;  ///< returns nearer than half of the target's length
  std::size_t hits = 0;

  Extent(const clouds::Cloud& cloud, double target_length) {
    for (const clouds::CloudBeam& beam : cloud.beams) {
      if (!beam.hit) continue;
      const Vector3d point = beam.range * beam_direction(beam.azimuth, beam.elevation);
      min_corner = min_corner.cwiseMin(point);
      max_corner = max_corner.cwiseMax(point);
      nearest = std::min(nearest, beam.range);
      farthest = std::max(farthest, beam.range);
      within += beam.range < 0.5 * target_length ? 1 : 0;
      ++hits;
    }
  }

  double spread() const { return (max_corner - min_corner).norm(); }
  bool around_origin() const {
    return (min_corner.array() < 0).all() && (max_corner.array() > 0).all();
  }
};

}  // namespace

void add_hints(const clouds::Cloud& cloud, const estimator::PreprocessedScan& scan,
               double target_length, estimator::SingleScanResult& result) {
  explain_drops(cloud, scan, result);
  const Extent extent(cloud, target_length);
  if (extent.hits == 0) return;
  const std::string target = "the target is " + shown(target_length) + " m long";
  // A target 100 times its length away is less than 10 mrad wide: too small to measure a pose.
  constexpr double max_lengths = 100;
  if (result.status != Status::ok) {
    if (target_length >= 3 * extent.farthest) {
      result.notes.push_back(target + " and all returns are within " + shown(extent.farthest) +
                             " m of the sensor: is its --length right?");
    } else if (extent.spread() > max_lengths * target_length) {
      result.notes.push_back(target + " and the cloud " + shown(extent.spread()) +
                             " m across: are its coordinates in mm? A header can state so, as in "
                             "'x (mm), y (mm), z (mm)'");
    }
  }
  if (extent.nearest > max_lengths * target_length &&
      extent.spread() <= max_lengths * target_length) {
    result.notes.push_back(target + " and the nearest return " + shown(extent.nearest) +
                           " m from the sensor: are coordinates in the sensor's frame?");
  }
  if (extent.max_corner.z() < 0) {
    result.notes.push_back(
        "all returns have a negative z, so z points backward (y up?): the pose is in the cloud's "
        "own axes, which are not Berth's (x right, y down, z along the boresight)");
  }
  if (extent.around_origin() && 2 * extent.within > extent.hits) {
    result.notes.push_back("the returns lie around the origin, most within " +
                           shown(0.5 * target_length) +
                           " m: the sensor would be inside the target; is the cloud in the "
                           "sensor's frame?");
  }
}

}  // namespace berth::commands
