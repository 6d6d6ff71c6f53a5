// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <span>
#include <utility>
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

/// What a beam would meet of the target in a pose.
struct BeamMeets {
  double range = std::numeric_limits<double>::infinity();  ///< m; infinite: nothing
  double variance = 0;                                     ///< m^2, of the range measured
};
/// m^2, of a range measured on the target. surface_sigma: of its distance from the mesh, m.
double range_variance(const BeamModel& noise, double surface_sigma, double range, double cosine);

/// The log odds (nats, in the mean) that a beam gives to what is true against another pose, before
/// it is measured: the Kullback-Leibler divergence of
///   p(z) = w_hit N(z; r, s^2) + (w_front + w_through) / depth,  p(nothing) = w_missing
/// of the two, with the usual PoseShares w; of a pose that it does not meet p(z) = 1 / (2 depth),
/// p(nothing) = 1/2. depth: over which what is not the target is spread, m.
double expected_evidence(const BeamMeets& truth, const BeamMeets& other, double depth);

/// The odds of a pose against the best one, that leads it by so many nats. Where the target is not
/// quite as modelled, a lead is worth no more than what it is beside the scatter of what beams give
/// to each [Vuong, Econometrica 57, 1989, without his mean]: of poses as probable as each other
///   lead / sqrt(sum (best_i - other_i)^2)
/// is normal. And where the other leads "no target" by what it is alone in, on beams that the best
/// leaves to what is smooth, then one of the two is what the surroundings do by themselves: so many
/// nats of theirs are worth no more than those required, and all of a lead by as much less. The
/// least certain of these and exp(-lead); 1 of equal ones.
/// @param best, other: nats of each beam. price: nats that the other must gain to be as probable as
/// "no target". required: log odds, of what is called found
double rival_odds(double lead, std::span<const double> best, std::span<const double> other,
                  double price, double required);

/// m, 1 sigma: of the true surface's distance from the mesh, as target.yaml says it, else of a bare
/// mesh.
double surface_sigma_of(const TargetModel& model, double bare);

/// The odds that a scan gives to the target in a pose, against something smooth being there.
/// A beam that should meet the target at r, with range z and background density b(z) (RangeImage):
///   z:       L/b = w_hit N(z; r, s^2) / b(z) + (w_front if z < r, w_through if z > r),
///   nothing: L/b = w_missing / (1 - p_returns);
/// all other beams are the background's under both, and so is one that ended before the sphere that
/// holds the target, or did not return beside such a one: whatever hides the target there does so
/// with or without it. So an occluder costs log w_front whatever its shape, and only what
/// neighbours do not foretell speaks for the target.
/// A piece of the target, a cube of an eighth of its length, is as modelled with probability 0.98;
/// else its beams are the background's, too, but for those that go through it and may return from
/// the next face beyond, at r2: L/b = 1/2 + N(z; r2, s2^2) / (2 b(z)). A piece's surface is off as
/// one, by N(0, surface_sigma^2) along the normals, over which the product of its beams is
/// integrated (Laplace): with hits' shares p, residuals r and slopes a = 1/cos, A = sum p a^2/s^2,
/// B = sum p a r/s^2,
///   offset d = B / (A + 1/sigma^2),   log odds = sum log (L/b)(r - a d) - d^2 / (2 sigma^2)
///                                                - log(1 + A sigma^2) / 2;
/// while ranges are widened, no face beyond is looked for, sigma counts in s alone, and a range
/// that fits so is weighed as if it fitted as it is: N keeps the peak that it has without, and is
/// at least b. Of a pose that climbs it has its own, and is at least exp(2) b: smooth faces, which
/// the background explains as well, draw it, too. The shares w are those most probable, and their
/// prior counts; of what is found at least half returns.
class PoseOdds {
 public:
  /// All must outlive it. surface_sigma: of the true surface's distance from the mesh, m.
  PoseOdds(const TargetModel& model, const RangeImage& image, double surface_sigma);

  /// The same with another log background density.
  PoseOdds with_background(const std::vector<double>& log_background) const;
  /// The same without beams that are marked, one by one: as if they had not been sent.
  PoseOdds without(const std::vector<char>& left_out) const;

  struct At {
    double log_odds = 0;
    PoseShares shares;    ///< most probable, given about 20 beams as PoseShares are
    double expected = 0;  ///< beams that should meet the target
    double present = 0;   ///< share of them on pieces that are as modelled
    Matrix6d information = Matrix6d::Zero();  ///< of ranges, as berth::perturbed
    Vector6d gradient = Vector6d::Zero();     ///< of log_odds, of ranges alone, shares held
  };
  /// @param annealing m, 1 sigma, added to ranges. thinning: every so many-th beam, and odds of all
  /// @param of_beams of each beam, or empty: what it adds to log_odds, but for the shares' prior
  At at(const Pose& pose, double annealing, int thinning, std::span<double> of_beams = {}) const;
  /// The same, and no more of it.
  double log_odds(const Pose& pose, double annealing, int thinning) const;

  struct Climbed {
    Pose pose;
    At at;  ///< as at() says
  };
  /// The pose of the highest odds about one: Gauss-Newton steps on ranges, and steps along the
  /// directions that ranges say least of, which beams at the outline may decide. Without rounds:
  /// one, of Gauss-Newton steps alone.
  Climbed climbed(const Pose& pose, double annealing, int thinning, int rounds) const;

 private:
  class Weighing;
  At weighed(const Pose& pose, double annealing, int thinning, bool climbs,
             std::span<double> of_beams) const;
  /// All but the gradient and the information, for which there is a thread's weighing.
  std::pair<At, Weighing&> weigh(const Pose& pose, double annealing, int thinning,
                                 bool climbs) const;
  void meet(const Pose& pose, double annealing, int thinning, Weighing& weighing) const;

  const TargetModel& model_;
  const RangeImage& image_;
  double surface_sigma_;
  std::vector<double> inverse_background_;  // of each beam
  std::vector<char> left_out_;              // of each beam
};

}  // namespace berth::estimator
