// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/acquire/pose_odds.h"
#include "estimator/acquire/template_match.h"
#include "estimator/acquisition/acquisition.h"

namespace berth::estimator {

struct HypothesisAcquisitionOptions {
  /// Probability, as the beams give it, that a pose called found is not the target's.
  double risk = 0.0025;
  /// Of a bare mesh: the true surface's distance from it, m, 1 sigma.
  double bare_surface_sigma_m = 0.004;
  int min_returns = 20;    ///< inside the gate
  int max_hypotheses = 4;  ///< reported
  int views = 320;         ///< that templates are made of
  TemplateMatchOptions match;
};

/// Finds the target's pose without any prior, among whatever else is in view. Templates of all
/// views are laid on all returns but those of large planes; the best are laid on the surface, climb
/// the odds of their beams, and are weighed by evidence, as modes of one posterior over all poses
/// in view and "no target".
class HypothesisAcquisition final : public Acquisition {
 public:
  HypothesisAcquisition(const TargetModel& model, const BeamModel& beam_model,
                        const HypothesisAcquisitionOptions& options);

  using Acquisition::acquire;
  std::string name() const override { return "hypotheses"; }
  AcquisitionResult acquire(const CleanScan& scan,
                            const std::vector<Hypothesis>& hints) const override;
  /// What the posterior says of these poses, each climbed to where it is highest: not of others.
  AcquisitionResult weigh(const CleanScan& scan, const std::vector<Pose>& poses) const;

 private:
  struct Mode {
    Pose pose;
    PoseOdds::At at;
    double log_evidence = 0;  ///< of this mode against no target
  };
  std::vector<Pose> proposed(const RangeImage& image, const PoseOdds& odds,
                             const std::vector<Hypothesis>& hints) const;
  std::vector<Mode> modes(const RangeImage& image, const PoseOdds& odds,
                          std::vector<Pose> poses) const;
  bool same(const Pose& a, const Pose& b) const;
  AcquisitionResult decided(const std::vector<Mode>& modes) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const HypothesisAcquisitionOptions& options_;
  double surface_sigma_;
  std::vector<ViewTemplate> templates_;
};

}  // namespace berth::estimator
