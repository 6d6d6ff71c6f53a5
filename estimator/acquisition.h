// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/beam_likelihood.h"
#include "estimator/icp.h"
#include "estimator/point_sets.h"

namespace berth::estimator {

struct AcquisitionOptions {
  double least_elongation = 1.35;   ///< of the model: below it PCA cannot tell its axis
  int least_points = 40;            ///< returns inside the gate
  int point_sets = 8;               ///< guesses of what is target and what is not
  int finalists_per_set = 4;        ///< and axis direction
  double decisive_margin = 8;       ///< log-likelihood by which the best must lead the second
  double least_evidence = 25;       ///< log-likelihood by which it must lead "no target at all"
  double least_explained = 0.8;     ///< share of the beams predicted to meet the target that do
  double most_through = 0.2;        ///< share of them that go through it
  double least_inlier_share = 0.6;  ///< of the returns about the target that fit it
  int most_hypotheses = 4;
  LikelihoodOptions likelihood;
};

/// A pose that may explain a scan.
struct Hypothesis {
  Pose pose;  ///< T_sensor_model
  double log_likelihood = 0;
  double probability = 0;
  Likelihood fit;
  double inlier_share = 0;   ///< of the returns about the target
  int equal_poses = 1;       ///< that a symmetry of the target makes one and the same
  bool constrained = false;  ///< the returns determine all six degrees of freedom
};

struct AcquisitionResult {
  enum class Status { found, ambiguous, not_found, refused };
  Status status = Status::not_found;
  std::string reason;                  ///< empty when found
  std::vector<Hypothesis> hypotheses;  ///< best first, distinct; probabilities sum to 1
  int point_sets = 0;
  int candidates = 0;  ///< poses that were polished and weighed
};

/// Finds the target's pose without any prior (paper, section 4.3): the major axis by PCA, then
/// exhaustive binary template matching over the rotation about it and three translations. As a lab
/// is not empty and a satellite nearly symmetric, several guesses of the target's points are tried,
/// the best matches of all are polished by ICP and the shared beam model decides among them.
class Acquisition {
 public:
  Acquisition(const TargetModel& model, const BeamModel& beam_model,
              const AcquisitionOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  /// hints: poses that an earlier scan suggested, if any.
  AcquisitionResult acquire(const CleanScan& scan, const std::vector<Pose>& hints = {}) const;

  /// Empty, or why this model cannot be acquired.
  std::string refusal() const;

 private:
  std::vector<Pose> match_templates(const std::vector<PointSet>& sets) const;
  std::vector<Pose> twins(const Pose& pose, int turns) const;
  bool is_symmetry(const Pose& a, const Pose& b) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const AcquisitionOptions& options_;
};

}  // namespace berth::estimator
