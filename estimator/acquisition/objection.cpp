// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/objection.h"

#include <algorithm>

#include "common/core/text.h"
#include "estimator/acquisition/view_acquisition.h"

namespace berth::estimator {

namespace {

/// Share of the beams past the target's rim that may be stopped beside it.
constexpr double most_at_rim = 0.15;

/// Whether what is about the target is something else: nearly all beams that should meet the
/// target do, and nearly all that pass its rim go on.
bool stands_clear(const BeamRace& race, const Contender& best, double noise_scale) {
  constexpr double least_inliers = 0.5;
  return crisp(best, noise_scale) && race.inlier_share(best) > least_inliers &&
         race.rim_share(best) < most_at_rim;
}

}  // namespace

bool crisp(const Contender& contender, double noise_scale) {
  // More noise than the LIDAR says explains what it likes.
  const double nearly_all = noise_scale > 1 ? 0.97 : 0.93;
  const Likelihood& fit = contender.weight.sum();
  return fit.explained > nearly_all * (fit.predicted - fit.occluded());
}

bool explains_most(const BeamRace& race, const Contender& contender) {
  constexpr double most = 0.75;
  return race.explained_share(contender) > most;
}

std::string objection(const BeamRace& race, const Contender& best,
                      const LikelihoodOptions& likelihood, const ViewAcquisitionOptions& options) {
  const Likelihood& fit = best.weight.sum();
  if (const double lead = race.evidence(best, likelihood); lead < options.least_evidence) {
    return "the best fit explains the scan hardly better than no target: log-likelihood " +
           fixed(lead, 0) + " more, at least " + fixed(options.least_evidence, 0) + " is needed";
  }
  const double visible = std::max(1, fit.predicted - fit.occluded());
  if (fit.explained < options.least_explained * visible) {
    return "only " + fixed(100 * fit.explained / visible, 0) +
           " % of the beams that the best fit puts on the target return from it, at least " +
           fixed(100 * options.least_explained, 0) + " % are needed";
  }
  const double scanned = race.scanned_share(best);
  if (const double seen = scanned * fit.explained / std::max(1, fit.predicted);
      seen < options.least_in_view) {
    return "something hides " + fixed(100.0 * fit.occluded() / std::max(1, fit.predicted), 0) +
           " % of the best fit, and " + fixed(100 * (1 - scanned), 0) +
           " % of it lie outside the scan; at least " + fixed(100 * options.least_in_view, 0) +
           " % have to be seen";
  }
  // What fits a part of the scan only, and that not well, may fit by chance.
  if (!explains_most(race, best) && !crisp(best, likelihood.noise_scale)) {
    if (const double share = race.rim_share(best); share > most_at_rim) {
      return fixed(100 * share, 0) +
             " % of the beams that pass the best fit closely are stopped beside it, at most " +
             fixed(100 * most_at_rim, 0) + " % may";
    }
    if (likelihood.noise_scale > 1) {
      return "the best fit explains a part of the scan only, and needs " +
             fixed(likelihood.noise_scale, 1) + " times the noise that the LIDAR says";
    }
  }
  if (const double share = race.misfit_share(best, likelihood);
      share > options.most_misfit_share && !stands_clear(race, best, likelihood.noise_scale)) {
    return fixed(100 * share, 0) +
           " % of the returns on the best fit's surface go on beside it, at most " +
           fixed(100 * options.most_misfit_share, 0) + " % may";
  }
  if (const double share = race.inlier_share(best);
      share < options.least_inlier_share && !stands_clear(race, best, likelihood.noise_scale)) {
    return "only " + fixed(100 * share, 0) +
           " % of the returns about the best fit belong to it, at least " +
           fixed(100 * options.least_inlier_share, 0) + " % are needed";
  }
  return "";
}

}  // namespace berth::estimator
