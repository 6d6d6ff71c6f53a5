// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/ground_truth_t.hpp>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "common/bus/loop.h"
#include "common/core/pose.h"

namespace berth::evaluation {

/// Where the replica was in the sensor frame: one sample, or truth interpolated to a time.
struct TruthSample {
  Utime utime = 0;
  Pose pose;                               ///< T_sensor_model
  Matrix6d covariance = Matrix6d::Zero();  ///< [m; rad], sensor frame
  Velocity velocity;                       ///< sensor frame
};

TruthSample sample_of(const ground_truth_t& message);

/// Ground truth over a run, in order of time whatever the order of arrival.
class TruthTrack {
 public:
  /// Samples further apart than this have a hole between them.
  static constexpr Utime max_gap = 100 * millisecond;

  void add(const TruthSample& sample);
  /// The same, while a run goes on: keeps the last 10 s to 20 s. A sample from before that is of a
  /// clock that went back, and the first of another time.
  void add_live(const TruthSample& sample);
  /// Drops samples older than this.
  void forget_before(Utime utime);
  /// Drops samples younger than this.
  void forget_after(Utime utime);

  /// Between the samples on either side; nothing outside the samples or in a hole: truth is never
  /// extrapolated. Covariances are interpolated linearly.
  std::optional<TruthSample> at(Utime utime) const;
  /// Samples from first to last, both included.
  std::span<const TruthSample> between(Utime first, Utime last) const;
  const std::vector<TruthSample>& samples() const { return samples_; }

 private:
  std::vector<TruthSample> samples_;
};

/// Source of the target's pose: GROUND_TRUTH or POSE_ESTIMATE.
enum class PoseSource { truth, estimate };

/// Where the target was over a log, of all its sessions.
class TargetPoses {
 public:
  /// @throws InputError when the log cannot be read.
  TargetPoses(const std::filesystem::path& log, PoseSource source);

  /// T_sensor_model (m) at the time of a return of that scan. Truth is interpolated. An estimate is
  /// that of the scan itself, of several the nearest in time, moved along its velocity. Nothing
  /// where there is no truth, or where the scan has no estimate with status OK.
  std::optional<Pose> at(std::int64_t session, std::int64_t scan_id, Utime utime) const;

 private:
  struct Estimate {
    Utime utime = 0;
    Pose pose;          // T_sensor_model
    Velocity velocity;  // sensor frame
  };
  std::map<std::int64_t, TruthTrack> truth_;                                          // by session
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Estimate>> estimates_;  // and scan
};

}  // namespace berth::evaluation
