// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/quantity.h"
#include "logs/measure/statistics.h"
#include "logs/run/run_record.h"

namespace berth::logs {

/// Point of the target's surface (model frame, m) nearest to a point of the model frame. Empty
/// where the target's mesh is not at hand.
using NearestPoint = std::function<Vector3d(const Vector3d&)>;

/// An estimate (status OK) beside the truth at its own time.
struct ComparedEstimate {
  EstimateSample estimate;
  TruthSample truth;
  Vector6d error;  ///< perturbed(truth, error) = estimate: [m; rad], sensor frame
};

/// One quantity over time.
struct Series {
  std::vector<Utime> utime;
  std::vector<double> value;        ///< SI
  std::vector<double> truth_sigma;  ///< 1 sigma of the value, from truth's covariance
  std::size_t without_truth = 0;    ///< samples left out because truth does not bracket them
};

/// One number about a phase.
struct Measured {
  double value;            ///< SI; NaN: could not be measured
  double uncertainty = 0;  ///< 1 sigma, from truth's own covariance
  std::int64_t samples = 0;
  std::string reason;  ///< why there is no value
};

class Measurer;

/// A named thing that can be measured on a run: a series of values, of which a statistic is taken,
/// or one number for a phase.
struct Measurement {
  std::string name;
  Dimension dimension;
  std::string unit;  ///< in which it is shown
  double unit_si;    ///< size of that unit
  std::string description;
  /// One of the two is set.
  std::function<Series(const Measurer&, const Phase&)> series;
  std::function<Measured(const Measurer&, const Phase&)> number;

  /// In the unit it is shown in.
  double shown(double si) const { return si / unit_si; }
};

const std::vector<Measurement>& measurements();
/// nullptr when there is no such measurement.
const Measurement* measurement_named(const std::string& name);

/// Measures a run. The same numbers in the engine at a run's end and from its log later.
class Measurer {
 public:
  /// The record must outlive it.
  Measurer(const RunRecord& record, NearestPoint nearest);

  /// @param statistic not looked at for measurements that are one number
  Measured measure(const Measurement& what, Statistic statistic, const Phase& phase) const;

  const RunRecord& record() const { return record_; }
  const std::vector<ComparedEstimate>& compared() const { return compared_; }
  /// Estimates with status OK for which there is no truth.
  const std::vector<Utime>& without_truth() const { return without_truth_; }
  const NearestPoint& nearest() const { return nearest_; }

  /// An estimate counts as current for this long.
  static constexpr Utime estimate_lifetime = 2 * second;

 private:
  const RunRecord& record_;
  NearestPoint nearest_;
  std::vector<ComparedEstimate> compared_;
  std::vector<Utime> without_truth_;
};

}  // namespace berth::logs
