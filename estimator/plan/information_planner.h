// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/plan/optimal_design.h"
#include "estimator/plan/pose_information.h"
#include "estimator/plan/windows.h"

namespace berth::estimator {

/// Windows and the precision expected of their scan.
struct InformationPlan {
  std::vector<Window> windows;  ///< empty when no beam would return
  double rms_bound = 0;  ///< m: root of the trace of the pose's covariance, see InformationPlanner
  double min_rms = 0;    ///< m: lower bound of that over all choices of windows or rays
};

/// A-optimal choice of windows: the trace of the pose's covariance is minimised, rotations scaled
/// by the target's half length, on the shared beam model. Beams that would miss the target add no
/// information.
///
/// A grid of beams is cast at the model in the predicted pose; the information of a small window is
/// the mean over the cells that it may cover, given the prediction's uncertainty. The windows of
/// the optimal design, and the best others, are then evaluated by a few beams each in poses spread
/// by that uncertainty, and the design is repeated with these.
class InformationPlanner {
 public:
  InformationPlanner(const TargetModel& model, const TargetScene& scene, const FieldOfView& field,
                     const PlannerOptions& options)
      : model_(model), scene_(scene), field_(field), options_(options) {}

  /// Deterministic.
  /// @param pose predicted T_sensor_model
  /// @param sigma m, standard deviation of a point of the target
  /// @param outline the part of the field of view in which the target may be
  /// @param others windows that the scan has besides
  InformationPlan plan(const Pose& pose, double sigma, const Window& outline, int beams,
                       const std::vector<Window>& others = {}) const;

  /// The number of beams of each window that minimises the trace. The windows' own counts are
  /// ignored.
  std::vector<int> share(const Pose& pose, double sigma, const std::vector<Window>& windows,
                         int beams, const std::vector<Window>& others) const;

 private:
  Matrix6d prior_information(const PoseView& view, const std::vector<Window>& others) const;
  double spread(double predicted_sigma) const;
  struct Grid;
  Grid cast(const PoseView& view, const Pose& pose, double sigma, const Window& outline,
            int beams) const;
  std::vector<Window> candidates(const Grid& grid, const Matrix6d& prior, int beams,
                                 InformationPlan& plan) const;
  DesignProblem evaluate_windows(const PoseView& view, const Pose& pose, double sigma,
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
