// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/plan/optimal_design.h"
#include "estimator/plan/pose_information.h"
#include "estimator/plan/windows.h"

namespace berth::estimator {

/// Windows, and what they are worth.
struct InformationPlan {
  std::vector<Window> windows;  ///< empty when no beam would return
  double rms_bound = 0;  ///< root of the least trace of the pose's covariance that a scan of these
                         ///< windows leaves; rotations times the target's half length, m
  double min_rms = 0;    ///< of no choice of windows or rays, as far as the view's cells tell, is
                         ///< it smaller
};

/// Chooses windows by what their returns add to the information about the pose (A-optimality:
/// least trace of its covariance, rotations times the target's half length), on the shared beam
/// model. Beams that would miss cost and add nothing.
///
/// A grid of beams is cast at the model in the predicted pose; what a small window would add is the
/// mean over the cells that it, or the error of the prediction, may reach. Of the windows that an
/// optimal design picks, and the best beside them, a few beams each are cast in poses spread as the
/// prediction's error; the design is made again with what came back.
class InformationPlanner {
 public:
  InformationPlanner(const TargetModel& model, const TargetScene& scene, const FieldOfView& field,
                     const PlannerOptions& options)
      : model_(model), scene_(scene), field_(field), options_(options) {}

  /// pose: predicted T_sensor_model; sigma: standard deviation of a point of the target about it,
  /// m. outline: the part of the field of view in which the target may be. others: windows that
  /// the scan has beside these. Deterministic.
  InformationPlan plan(const Pose& pose, double sigma, const Window& outline, int beams,
                       const std::vector<Window>& others = {}) const;

  /// Beams for each of these windows, so that the trace is least. Their own counts do not matter.
  std::vector<int> share(const Pose& pose, double sigma, const std::vector<Window>& windows,
                         int beams, const std::vector<Window>& others) const;

 private:
  Matrix6d known_before(const PoseView& view, const std::vector<Window>& others) const;
  double spread(double predicted_sigma) const;
  struct Grid;
  Grid cast(const PoseView& view, const Pose& pose, double sigma, const Window& outline,
            int beams) const;
  std::vector<Window> candidates(const Grid& grid, const Matrix6d& prior, int beams,
                                 InformationPlan& plan) const;
  DesignProblem look_closer(const PoseView& view, const Pose& pose, double sigma,
                            const std::vector<Window>& windows, const Matrix6d& prior,
                            int beams) const;
  double expected_trace(const PoseView& view, const Pose& pose, double sigma,
                        const std::vector<Window>& windows, const Matrix6d& prior) const;

  const TargetModel& model_;
  const TargetScene& scene_;
  const FieldOfView& field_;
  const PlannerOptions& options_;
};

}  // namespace berth::estimator
