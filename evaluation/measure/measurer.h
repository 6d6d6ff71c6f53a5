// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/targets/target.h"
#include "evaluation/measure/measurement.h"
#include "evaluation/measure/truth_join.h"

namespace berth::evaluation {

/// Point of the target's surface (model frame, m) nearest to a point of the model frame. Empty
/// where the target's mesh is not at hand.
struct NearestPoint : std::function<Vector3d(const Vector3d&)> {
  using function::function;
  std::shared_ptr<const RayCaster> rays;  ///< at the same surface
};

/// Measures a run. The same numbers in the engine at a run's end and from its log later.
class Measurer {
 public:
  /// The record must outlive it.
  Measurer(const RunRecord& record, NearestPoint nearest);

  /// @param statistic not looked at for measurements that are one number
  Measured measure(const Measurement& what, Statistic statistic, const Phase& phase) const;

  const RunRecord& record() const { return record_; }
  const std::vector<ComparedEstimate>& compared() const { return compared_; }
  /// Symmetry of the target, from RUN_INFO: poses that count as equal.
  const SymmetryGroup& symmetry() const { return symmetry_; }
  /// Estimates with status OK for which there is no truth.
  const std::vector<Utime>& without_truth() const { return without_truth_; }
  /// The estimate of that time joined with truth; nullptr where there is none.
  const ComparedEstimate* compared_at(Utime utime) const;
  const NearestPoint& nearest() const { return nearest_; }
  /// The docking port of the run's target that the phase is about: of the last approach that began
  /// by its end, else the first one. nullptr when the target has none.
  const DockingPort* port(const Phase& phase) const;

  /// From the model's origin to the target's point that is nearest to the sensor, where it truly
  /// was, sensor frame; only with nearest(). Each is looked up once.
  Vector3d surface_lever(const TruthSample& truth) const;

  /// Root mean square distance, m, of the estimate's returns from the target's surface in the
  /// estimated pose at their times. The returns are those, of at most 200 of its packets, of beams
  /// that met the target in its true pose, a tenth of its length off at most: the selection does
  /// not depend on the estimate. NaN without any. Each is looked up once.
  double residual(const ComparedEstimate& compared) const;

  /// An estimate counts as current for this long.
  static constexpr Utime estimate_lifetime = 2 * second;

 private:
  const RunRecord& record_;
  NearestPoint nearest_;
  std::vector<DockingPort> ports_;
  SymmetryGroup symmetry_;
  std::vector<ComparedEstimate> compared_;
  std::vector<Utime> without_truth_;
  mutable std::map<Utime, Vector3d> levers_;
  mutable std::map<Utime, double> residuals_;
};

}  // namespace berth::evaluation
