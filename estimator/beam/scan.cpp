// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/beam/scan.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace berth::estimator {
namespace {

constexpr double no_return = std::numeric_limits<double>::infinity();

/// Finds repeated beams: a hash table with open addressing.
class Repetitions {
 public:
  explicit Repetitions(const std::vector<Beam>& beams, std::size_t max_beams)
      : beams_(beams), table_(std::bit_ceil(2 * max_beams + 1)) {}

  /// Whether a beam of this direction and range was seen; if not, it is registered as the next one
  /// of `beams`.
  bool take(const Beam& beam) {
    const std::size_t mask = table_.size() - 1;
    for (std::size_t i = hash(beam) & mask;; i = (i + 1) & mask) {
      if (table_[i] == 0) {
        table_[i] = static_cast<std::uint32_t>(beams_.size() + 1);
        return false;
      }
      const Beam& other = beams_[table_[i] - 1];
      if (other.range == beam.range && other.direction == beam.direction) return true;
    }
  }

 private:
  static std::size_t hash(const Beam& beam) {
    constexpr std::uint64_t odd = 0x9E3779B97F4A7C15;  // 2^64 over the golden ratio
    std::uint64_t mixed = 0;
    for (const double value : {beam.range, beam.direction.x(), beam.direction.y()}) {
      mixed = (mixed ^ std::bit_cast<std::uint64_t>(value)) * odd;
      mixed ^= mixed >> 32;
    }
    return mixed;
  }

  const std::vector<Beam>& beams_;
  std::vector<std::uint32_t> table_;  ///< index of a beam, from 1; 0: free
};

}  // namespace

PreprocessedScan preprocess(const std::vector<RawBeam>& scan, const RangeGate& gate,
                            const BeamModel& beam_model) {
  PreprocessedScan clean;
  clean.received = static_cast<int>(scan.size());
  clean.beams.reserve(scan.size());
  Repetitions repetitions(clean.beams, (beam_model.second_returns ? 2 : 1) * scan.size());
  std::int64_t sum_of_times = 0;
  for (const RawBeam& raw : scan) {
    if (!std::isfinite(raw.azimuth) || !std::isfinite(raw.elevation)) {
      ++clean.invalid;
      continue;
    }
    Beam beam{beam_direction(raw.azimuth, raw.elevation), no_return, raw.utime, raw.range_sigma};
    if (raw.status == BeamStatus::miss || raw.status == BeamStatus::too_far) {
      if (repetitions.take(beam)) {
        ++clean.repeated;
        continue;
      }
      ++clean.misses;
      clean.beams.push_back(beam);
      continue;
    }
    if (raw.status == BeamStatus::too_near) {
      ++clean.too_near;
      continue;
    }
    if (raw.status == BeamStatus::saturated) {
      ++clean.saturated;
      continue;
    }
    // One return.
    const auto take = [&](double range, double range_sigma, double intensity) {
      // written so that a NaN fails too
      if (!(range > 0 && range <= beam_model.range_max_m)) {
        ++clean.invalid;
        return;
      }
      beam.range = range;
      beam.range_sigma = range_sigma;
      beam.intensity = intensity;
      if (repetitions.take(beam)) {
        ++clean.repeated;
        return;
      }
      clean.beams.push_back(beam);
      if (range < gate.near) {
        ++clean.nearer;
      } else if (range > gate.far) {
        ++clean.farther;
      } else {
        clean.points.push_back(beam.point());
        clean.beam_of_point.push_back(static_cast<std::uint32_t>(clean.beams.size() - 1));
        if (clean.points.size() == 1) clean.utime_first = clean.utime_last = raw.utime;
        clean.utime_first = std::min(clean.utime_first, raw.utime);
        clean.utime_last = std::max(clean.utime_last, raw.utime);
        sum_of_times += raw.utime - scan.front().utime;
      }
    };
    take(raw.range, raw.range_sigma, raw.intensity);
    if (beam_model.second_returns && raw.second_range != 0) {
      ++clean.received;
      take(raw.second_range, raw.second_range_sigma, raw.second_intensity);
    }
  }
  if (!clean.points.empty()) {
    clean.utime_mean =
        scan.front().utime + sum_of_times / static_cast<std::int64_t>(clean.points.size());
  }
  return clean;
}

PreprocessedScan at_mean_time(const PreprocessedScan& scan, const Velocity& velocity,
                              const Vector3d& origin) {
  PreprocessedScan still = scan;
  if (scan.points.empty() || (velocity.linear.isZero(0) && velocity.angular.isZero(0))) {
    return still;
  }
  const double distance = origin.norm();
  for (Beam& beam : still.beams) {
    const double late = static_cast<double>(beam.utime - scan.utime_mean) * 1e-6;
    const Vector3d point = beam.hit() ? beam.point() : Vector3d(distance * beam.direction);
    const Vector3d moved =
        point - late * (velocity.linear + velocity.angular.cross(point - origin));
    const double range = moved.norm();
    if (beam.hit()) beam.range = range;
    beam.direction = moved / range;
    beam.utime = scan.utime_mean;
  }
  for (std::size_t i = 0; i < still.points.size(); ++i) {
    still.points[i] = still.beams[still.beam_of_point[i]].point();
  }
  return still;
}

}  // namespace berth::estimator
