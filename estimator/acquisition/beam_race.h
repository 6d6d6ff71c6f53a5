// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "estimator/acquisition/acquisition.h"
#include "estimator/acquisition/beam_polish.h"

namespace berth::estimator {

/// A pose in the running.
struct Contender {
  Pose pose;  ///< T_sensor_model
  BeamLikelihood weight;
  double prior = 0;  ///< log-likelihood that an earlier scan gave it, less that of the best then

  double log_likelihood() const { return weight.sum().log_likelihood + prior; }
  /// Beams that should meet the target and did not.
  int contradictions() const { return weight.sum().predicted - weight.sum().explained; }
};

/// Log-likelihood that a pose may lack because it is not settled yet.
struct Mercy {
  double of_contradiction = 0;  ///< for each beam that should meet the target and did not
  double of_beam = 0;           ///< for each beam that should meet the target
};

/// Weighs poses against each other on the beams of one scan, taken in an order that looks random
/// and does not depend on the order in which they came.
class BeamRace {
 public:
  /// earlier: what an earlier scan left open. All must outlive this.
  BeamRace(const TargetModel& model, const BeamModel& beam_model, const CleanScan& scan,
           const std::vector<Hypothesis>& earlier);

  /// Weighs poses on more and more beams, block by block, leaves out those that fall behind the
  /// best by more than `hopeless`, and ends early when after enough_beams one is left. Best first.
  /// mercy: what is overlooked until then. kept: so many are never left out.
  std::vector<Contender> run(const std::vector<Pose>& poses, const LikelihoodOptions& likelihood,
                             std::size_t most_beams, std::size_t enough_beams, Mercy mercy = {},
                             std::size_t kept = 1) const;
  /// The poses fitted to the ranges of so many returns, see fit_beams.
  std::vector<Pose> fitted(const std::vector<Pose>& poses, std::size_t returns, double first_gate,
                           double last_gate, int iterations) const;
  /// The pose climbed to its likelihood's optimum nearby on so many beams, see polished() in
  /// beam_polish.h.
  Pose polished(const Pose& pose, const LikelihoodOptions& likelihood, std::size_t beams,
                const PolishOptions& how) const;

  /// The pose followed to where tracking takes it, from some centimetres off, by a LIDAR so many
  /// times as noisy as the beam model says; itself where tracking loses it.
  Pose followed(const Pose& pose, double noise_scale) const;

  /// Slack by which two poses on their way are taken for the same place.
  static constexpr double one_place = 0.7;
  /// Whether two poses are one, an exact symmetry apart or not. slack 1: 4 degrees and 3 % of the
  /// length.
  bool same(const Pose& a, const Pose& b, double slack) const;
  /// The first of each set of same poses, at most so many.
  std::vector<Pose> distinct(const std::vector<Pose>& poses, std::size_t most, double slack) const;
  std::vector<Contender> distinct(const std::vector<Contender>& contenders, double slack) const;

  /// The options with the shares of drop-outs, outliers and background that a leading pose shows,
  /// and the noise where that is more than a pose not yet polished explains.
  LikelihoodOptions as_seen_from(const Contender& leader, const LikelihoodOptions& options) const;
  /// Share of the returns about the target, of the beams that weighed it, that the pose explains.
  double inlier_share(const Contender& contender) const;
  /// Share of the returns on and beside the target's surface that are beside it: what goes on where
  /// the target ends, or stands off it, is not the target.
  double misfit_share(const Contender& contender, const LikelihoodOptions& likelihood) const;
  /// Share that something beside the target stops, of the beams that pass its rim closely and are
  /// not stopped before it. Where the pose is right they go on, but for where something else
  /// touches it.
  double rim_share(const Contender& contender) const;
  /// Share of all returns inside the gate that lie on or beside the target's surface.
  double share_about(const Contender& contender) const;
  /// Share explained of all returns inside the gate.
  double explained_share(const Contender& contender) const;
  /// Share of the target's surface, seen or not, that lies within the scan's outline.
  double scanned_share(const Contender& contender) const;
  /// Log-likelihood by which it leads "no target at all".
  double evidence(const Contender& contender, const LikelihoodOptions& likelihood) const;

  /// Returns inside the gate, in the race's order, at most 1500.
  const std::vector<Beam>& returns() const { return returns_; }
  std::size_t beams() const { return order_.size(); }
  /// So many beams of the race's order that so many of them are returns inside the gate, if there
  /// are as many; at least `least`.
  std::size_t beams_with(std::size_t returns, std::size_t least) const;

 private:
  const CleanScan& few() const;
  double noise_seen_from(const Contender& leader, const LikelihoodOptions& options) const;
  double prior_of(const Pose& pose) const;
  /// Calls visit(beam, inside the gate) for the beams that weighed the contender.
  template <class Visit>
  void for_its_beams(const Contender& contender, Visit visit) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const CleanScan& scan_;
  const std::vector<Hypothesis>& earlier_;
  std::vector<std::uint32_t> order_;
  std::vector<bool> gated_;  // beams that returned from inside the gate
  std::vector<Beam> returns_;
  mutable std::optional<CleanScan> few_;  // once it is asked for
};

}  // namespace berth::estimator
