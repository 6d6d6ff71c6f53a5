// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/track/scan_likelihood.h"
#include "estimator/track/tracking.h"

namespace berth::estimator {

struct LikelihoodTrackingOptions {
  /// Of a bare mesh, whose surface nobody has described: the true surface's distance from it (m, 1
  /// sigma) is learnt, from about this, and within about a factor of this.
  double bare_surface_sigma_m = 0.004;
  double bare_surface_factor = 4;
  /// The same factor where target.yaml says the sigma.
  double described_surface_factor = 1.5;
  /// Share of the beams that should return from the target as modelled and must.
  double min_fit = 0.5;
  int min_returns = 20;
  /// Of denser scans every so many-th beam is used, so that about so many return: a choice of cost.
  int max_returns = 3000;
  int max_coarse_returns = 300;  ///< ... while the likelihood is widened
};

/// Maximum a posteriori pose of one scan under the likelihood of its beams (ScanFit), by
/// Levenberg-Marquardt from wide to narrow (annealing), with the surface's departures from the mesh
/// marginalised. Covariance: Laplace's approximation.
class LikelihoodTracking final : public Tracking {
 public:
  LikelihoodTracking(const TargetModel& model, const BeamModel& beam_model,
                     const LikelihoodTrackingOptions& options);

  std::string name() const override { return "likelihood"; }
  TrackingResult track(const CleanScan& scan, const Prediction& predicted) const override;

 private:
  const TargetModel& model_;
  const BeamModel& beam_model_;
  LikelihoodTrackingOptions options_;
  TargetScene scene_;
  double radius_;  // m, of the sphere that holds the target, joints turned
  std::vector<ScanFit::Surface> surface_of_face_;
  double scale_prior_ = 1;  // of the logarithm of the scale on all sigmas, 1 sigma
};

}  // namespace berth::estimator
