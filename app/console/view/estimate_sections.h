// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_diagnostics_t.hpp>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "app/console/view/section.h"
#include "evaluation/measure/measurer.h"
#include "logs/file/log_event.h"

namespace berth::console {

/// The section `truth`.
std::string truth_json(const evaluation::TruthSample& truth);

/// The section `estimate`. compared: against truth, where truth is known already; latency: from the
/// last return to when the estimate was published.
std::string estimate_json(const pose_estimate_t& estimate,
                          const std::optional<evaluation::ComparedEstimate>& compared,
                          std::optional<Utime> latency);

/// Ellipsoid of one standard deviation: its half axes, longest last, and the rotation that turns
/// x, y, z into their directions.
struct Ellipsoid {
  Vector3d radii;
  Quaterniond rotation;
};
Ellipsoid ellipsoid_of(const Matrix3d& covariance);

/// One POSE_ESTIMATE with later data: truth about its time, and its latency.
struct Sample {
  pose_estimate_t estimate;
  std::optional<evaluation::ComparedEstimate> compared;
  std::optional<Utime> latency;  ///< from the last return to when it was published
};

/// Joins estimates with truth and latency. Data later than a second after an estimate are left out.
class Samples {
 public:
  using Ready = std::function<void(const Sample&)>;
  /// ready: receives every estimate once, in their order.
  explicit Samples(Ready ready) : ready_(std::move(ready)) {}

  void take(const logs::LogEvent& event);
  /// Publishes what is complete, or has waited long enough.
  void advance(Utime now);
  /// Publishes what is left.
  void finish();

 private:
  struct Waiting {
    Sample sample;
    Utime received = 0;
  };
  void complete(Waiting& waiting) const;
  void publish_first();

  Ready ready_;
  SymmetryGroup symmetry_;                   // of the run's target
  evaluation::TruthTrack truth_;             // of the last seconds
  std::map<std::int64_t, Utime> latencies_;  // by seq of the estimate
  std::deque<Waiting> waiting_;
};

/// An entry of the list `samples`; time counts from start.
std::string sample_json(const Sample& sample, Utime start);

}  // namespace berth::console
