// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/ground_truth_t.hpp>
#include <optional>
#include <span>
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

}  // namespace berth::evaluation
