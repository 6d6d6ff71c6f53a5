// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "estimator/acquire/range_image.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// Shares of the beams that should meet the target in a pose, by outcome.
struct PoseShares {
  double hit = 0.8;       ///< returned from it
  double front = 0.1;     ///< returned from before it
  double through = 0.03;  ///< returned from behind it
  double missing = 0.07;  ///< did not return
};

/// The range expected of a beam in a pose.
struct ExpectedRange {
  double range = std::numeric_limits<double>::infinity();  ///< m; infinite: passes the target
  double variance = 0;                                     ///< m^2, of a measured range
};
/// m^2, of a range measured on the target. surface_sigma: of the true surface's distance from the
/// mesh, m. cosine: of incidence.
double range_variance(const BeamModel& noise, double surface_sigma, double range, double cosine);

/// Expected log odds (nats) of one beam for the true pose against another: the Kullback-Leibler
/// divergence between the two predictive densities
///   p(z) = w_hit N(z; r, s^2) + (w_front + w_through) / depth,  p(no return) = w_missing
/// with the prior PoseShares w; for a pose that the beam passes p(z) = 1 / (2 depth), p(no return)
/// = 1/2. depth: over which other ranges are uniform, m.
double expected_evidence(const ExpectedRange& truth, const ExpectedRange& other, double depth);

/// Odds of a rival against the best pose, which leads by `lead` nats: the larger of
///   exp(-lead / max(1, excess / required)),
///   P / (1 - P), P = Phi(-lead / sqrt(sum (best_i - other_i)^2)).
/// The first calibrates log odds by clutter: excess is the sum of the rival's nats on beams that
/// the best pose assigns to the background, less threshold. One of two exclusive poses is clutter,
/// which then reaches so much by itself. The second is Vuong's test [Econometrica 57, 1989, without
/// the term of the mean]: where the model errs, a lead counts relative to the scatter of the beams'
/// contributions.
/// @param best, other nats of each beam
/// @param threshold nats at which the rival is as probable as "no target"
/// @param required log odds of a pose reported as found
double rival_odds(double lead, std::span<const double> best, std::span<const double> other,
                  double threshold, double required);

/// m, 1 sigma, of the true surface's distance from the mesh: the largest of target.yaml's parts, or
/// `bare` for a bare mesh.
double surface_sigma_of(const TargetModel& model, double bare);

/// Odds of the target in a pose against a smooth background, given a scan. A beam that should meet
/// the target at r, with range z and background density b(z) (RangeImage), contributes
///   z:         L/b = w_hit N(z; r, s^2) / b(z) + (w_front if z < r, w_through if z > r),
///   no return: L/b = w_missing / (1 - p_returns).
/// All other beams belong to the background under both hypotheses, and so do beams that end before
/// the sphere that holds the target and, next to those, beams without return: they are occluded
/// either way. An occluder thus costs log w_front per beam, whatever its shape.
///
/// The target is divided into pieces, cubes of an eighth of its length, each as modelled with
/// probability 0.98. Otherwise its beams belong to the background; those that pass it may return
/// from the next face at r2: L/b = 1/2 + N(z; r2, s2^2) / (2 b(z)). A piece's surface has one
/// offset d ~ N(0, sigma^2) along the normals, which is integrated out by Laplace's approximation:
/// with responsibilities p of hits, residuals r and slopes a = 1/cos(incidence), A = sum p a^2/s^2,
/// B = sum p a r/s^2,
///   d = B / (A + 1/sigma^2),   log odds = sum log (L/b)(r - a d) - d^2 / (2 sigma^2)
///                                         - log(1 + A sigma^2) / 2.
///
/// With annealing, ranges have the added variance, sigma is part of s, and no rear face is
/// considered. N then keeps the peak it has without annealing and is at least b, so that smooth
/// surfaces, which the background explains, do not reject the pose; while a pose is refined it has
/// its annealed peak and is at least exp(2) b, so that they attract it. The shares w are estimated
/// by expectation maximisation under their prior.
class PoseOdds {
 public:
  /// All must outlive it. surface_sigma: of the true surface's distance from the mesh, m.
  PoseOdds(const TargetModel& model, const RangeImage& image, double surface_sigma);

  /// A copy with another log background density.
  PoseOdds with_background(const std::vector<double>& log_background) const;
  /// A copy without the marked beams.
  PoseOdds without(const std::vector<char>& left_out) const;

  /// The odds and their derivatives at a pose.
  struct At {
    double log_odds = 0;
    PoseShares shares;                        ///< estimated, with a prior of 20 beams
    double expected = 0;                      ///< number of beams that should meet the target
    double present = 0;                       ///< share of them on pieces that are as modelled
    Matrix6d information = Matrix6d::Zero();  ///< of ranges, as berth::perturbed
    Vector6d gradient = Vector6d::Zero();     ///< of log_odds, by ranges, shares fixed
  };
  /// @param annealing m, 1 sigma, added to ranges
  /// @param thinning every n-th beam is used; odds are of all
  /// @param of_beams empty, or set to each beam's contribution to log_odds, the shares' prior left
  /// out
  At at(const Pose& pose, double annealing, int thinning, std::span<double> of_beams = {}) const;
  /// The same without derivatives.
  double log_odds(const Pose& pose, double annealing, int thinning) const;

  /// A local maximum.
  struct Refined {
    Pose pose;
    At at;  ///< as at() gives it
  };
  /// The local maximum of the odds from a pose: Gauss-Newton steps on ranges; in each round also
  /// line searches along the three weakest directions of the information, which beams at the
  /// outline may determine. 0 rounds: Gauss-Newton steps only.
  Refined refined(const Pose& pose, double annealing, int thinning, int rounds) const;

 private:
  class Evaluation;
  At evaluated(const Pose& pose, double annealing, int thinning, bool refining,
               std::span<double> of_beams) const;
  /// Odds without derivatives, and the thread's evaluation, for these.
  std::pair<At, Evaluation&> weigh(const Pose& pose, double annealing, int thinning,
                                   bool refining) const;
  void meet(const Pose& pose, double annealing, int thinning, Evaluation& evaluation) const;

  const TargetModel& model_;
  const RangeImage& image_;
  double surface_sigma_;
  std::vector<double> inverse_background_;  // of each beam
  std::vector<char> left_out_;              // of each beam
};

}  // namespace berth::estimator
