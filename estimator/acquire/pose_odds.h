// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquire/range_image.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// What the beams that a pose concerns did, as shares of those that should meet the target there.
struct PoseShares {
  double hit = 0.8;       ///< returned from it
  double front = 0.1;     ///< stopped before it
  double through = 0.03;  ///< went through it
  double missing = 0.07;  ///< did not return
};

/// The odds that a scan gives to the target in a pose, against something smooth being there.
/// A beam that should meet the target at r, with range z and background density b(z) (RangeImage):
///   z:       L/b = w_hit N(z; r, s^2) / b(z) + (w_front if z < r, w_through if z > r),
///   nothing: L/b = w_missing / (1 - p_returns);
/// all other beams are the background's under both. So an occluder costs log w_front whatever its
/// shape, and only what neighbours do not foretell speaks for the target. A piece of the target is
/// as modelled with probability 0.98; else its beams are the background's, too. The shares w are
/// those most probable, and their prior counts.
class PoseOdds {
 public:
  /// All must outlive it. surface_sigma: of the true surface's distance from the mesh, m.
  PoseOdds(const TargetModel& model, const RangeImage& image, double surface_sigma);

  struct At {
    double log_odds = 0;
    PoseShares shares;    ///< most probable, given about 20 beams as PoseShares are
    double expected = 0;  ///< beams that should meet the target
    Matrix6d information = Matrix6d::Zero();  ///< of ranges, as berth::perturbed
    Vector6d gradient = Vector6d::Zero();     ///< of log_odds, of ranges alone, shares held
  };
  /// @param annealing m, 1 sigma, added to ranges. thinning: every so many-th beam, and odds of all
  At at(const Pose& pose, double annealing, int thinning) const;

  /// The pose of the highest odds about one: Gauss-Newton steps on ranges, and steps along the
  /// directions that ranges say least of, which beams at the outline may decide. Without rounds:
  /// one, of Gauss-Newton steps alone.
  Pose climbed(const Pose& pose, double annealing, int thinning, int rounds) const;

 private:
  const TargetModel& model_;
  const RangeImage& image_;
  double surface_sigma_;
  std::vector<double> inverse_background_;  // of each beam
};

}  // namespace berth::estimator
