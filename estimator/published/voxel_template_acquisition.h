// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/acquire/acquisition.h"
#include "estimator/published/beam_registration.h"
#include "estimator/published/icp.h"
#include "estimator/published/point_sets.h"

namespace berth::estimator {

struct VoxelTemplateOptions {
  double min_elongation = 1.35;   ///< of the model: below it PCA cannot tell its axis
  int min_points = 40;            ///< returns inside the gate
  int point_sets = 8;             ///< guesses of what is target and what is not
  int finalists_per_set = 4;      ///< and axis direction
  double decisive_margin = 8;     ///< log-likelihood by which the best must lead the second
  double min_evidence = 25;       ///< log-likelihood by which it must lead "no target at all"
  double min_explained = 0.8;     ///< share of the beams predicted to meet the target that do
  double max_through = 0.2;       ///< share of them that go through it
  double min_inlier_share = 0.6;  ///< of the returns about the target that fit it
  int max_hypotheses = 4;
  LikelihoodOptions likelihood;
};

/// Finds the target's pose without any prior (paper, section 4.3): the major axis by PCA, then
/// exhaustive binary template matching over the rotation about it and three translations. As a lab
/// is not empty and a satellite nearly symmetric, several guesses of the target's points are tried,
/// the best matches of all are polished by ICP and the shared beam model decides among them.
class VoxelTemplateAcquisition final : public Acquisition {
 public:
  VoxelTemplateAcquisition(const TargetModel& model, const BeamModel& beam_model,
                           const VoxelTemplateOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  using Acquisition::acquire;
  std::string name() const override { return "voxel_template"; }
  std::string refusal() const override;
  AcquisitionResult acquire(const CleanScan& scan,
                            const std::vector<Hypothesis>& hints) const override;

 private:
  std::vector<Pose> match_templates(const std::vector<PointSet>& sets) const;
  std::vector<Pose> twins(const Pose& pose, int turns) const;
  bool is_symmetry(const Pose& a, const Pose& b) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const VoxelTemplateOptions& options_;
};

}  // namespace berth::estimator
