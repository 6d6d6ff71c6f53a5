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
  double min_elongation = 1.35;   ///< of the model: below it PCA cannot determine its axis
  int min_points = 40;            ///< returns inside the gate
  int point_sets = 8;             ///< candidate segmentations
  int finalists_per_set = 4;      ///< and axis direction
  double decisive_margin = 8;     ///< log-likelihood ratio of the best to the second hypothesis
  double min_evidence = 25;       ///< log-likelihood ratio of the best hypothesis to "no target"
  double min_explained = 0.8;     ///< share of beams predicted on the target that return from it
  double max_through = 0.2;       ///< share of them that pass through it
  double min_inlier_share = 0.6;  ///< of the returns about the target
  int max_hypotheses = 4;
  LikelihoodOptions likelihood;
};

/// Acquisition without prior (paper, section 4.3): the major axis by PCA, then exhaustive binary
/// template matching over the rotation about it and three translations. For cluttered scans and
/// nearly symmetric targets several candidate segmentations are matched, the best matches are
/// refined by ICP, and the beam likelihood decides.
class VoxelTemplateAcquisition final : public Acquisition {
 public:
  VoxelTemplateAcquisition(const TargetModel& model, const BeamModel& beam_model,
                           const VoxelTemplateOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  using Acquisition::acquire;
  std::string name() const override { return "voxel_template"; }
  std::string refusal() const override;
  AcquisitionResult acquire(const PreprocessedScan& scan,
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
