// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/track/scan_likelihood.h"
#include "estimator/track/tracking.h"

namespace berth::estimator {

struct LikelihoodTrackingOptions {
  /// Of a bare mesh, whose surface is not described: prior of the true surface's distance from it
  /// (m, 1 sigma), and the standard deviation of its log-normal scale, as a factor.
  double bare_surface_sigma_m = 0.004;
  double bare_surface_factor = 4;
  /// The same factor where target.yaml describes the surface.
  double described_surface_factor = 1.5;
  /// Minimum share of the expected returns that fit the target as modelled.
  double min_fit = 0.5;
  int min_returns = 20;
  /// Denser scans are thinned to about so many returns; annealed stages further: computing time
  /// only.
  int max_returns = 3000;
  int max_coarse_returns = 300;
};

/// Maximum a posteriori pose of one scan under the likelihood of its beams (ScanLikelihood), by
/// Levenberg-Marquardt with annealing, the surface's departures from the mesh marginalised.
/// Covariance: Laplace's approximation.
class LikelihoodTracking final : public Tracking {
 public:
  LikelihoodTracking(const TargetModel& model, const BeamModel& beam_model,
                     const LikelihoodTrackingOptions& options);

  std::string name() const override { return "likelihood"; }
  TrackingResult track(const PreprocessedScan& scan, const Prediction& predicted) const override;

 private:
  const TargetModel& model_;
  const BeamModel& beam_model_;
  LikelihoodTrackingOptions options_;
  TargetScene scene_;
  double radius_;  // m, of the sphere that holds the target at any joint angle
  std::vector<ScanLikelihood::Surface> surface_of_face_;
  double scale_prior_ =
      1;  // standard deviation of the logarithm of the scale on all surface sigmas
};

}  // namespace berth::estimator
