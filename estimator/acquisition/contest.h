// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/acquisition/beam_race.h"

namespace berth::estimator {

struct ViewAcquisitionOptions;

/// Between rough poses: fits them, races them on the beams of one scan, takes those that may win to
/// where they fit best, and races them again. What is passed in must outlive it.
class Contest {
 public:
  Contest(const TargetModel& model, const ViewAcquisitionOptions& options, const BeamRace& race);

  /// From rough poses to those few between which all beams decide: distinct, best first. effort:
  /// times as many beams and finalists as usual.
  std::vector<Contender> settle(std::vector<Pose> poses, std::size_t effort = 1);
  /// The same from poses that are nearly right.
  std::vector<Contender> decide(std::vector<Pose> poses);
  /// The likelihood is that of what the scan shows from there.
  void look_from(const Contender& leader);
  /// Whether beams contradict even a winner that was taken to where it fits best: there may be
  /// another that few beams did not tell.
  bool unresolved(const Contender& winner) const;
  /// Log-likelihood by which the best must lead another pose.
  double decisive_lead(const Contender& best, const Contender& other) const;

  /// With the shares of drop-outs, outliers and background that the scan shows.
  const LikelihoodOptions& likelihood() const { return likelihood_; }
  /// How many poses have been weighed on all beams.
  int candidates() const { return candidates_; }

 private:
  std::vector<Contender> race(const std::vector<Pose>& poses, std::size_t most_beams);
  template <class Better>
  std::vector<Contender> improved(std::vector<Contender> found, Better better);
  std::vector<Pose> counterparts(const std::vector<Pose>& poses) const;
  std::size_t few_beams(std::size_t effort) const;
  LikelihoodOptions coarsened(double model_sigma) const;
  Mercy mercy() const;
  bool doubtful(const Contender& contender, double most) const;
  bool looks_alike(const Symmetry& symmetry) const;

  const TargetModel& model_;
  const ViewAcquisitionOptions& options_;
  const BeamRace& race_;
  LikelihoodOptions likelihood_;
  bool has_alike_ = false;
  bool alone_ = false;     // hardly a return is of anything but the target
  bool followed_ = false;  // in the last decision
  int candidates_ = 0;
};

std::vector<Pose> poses_of(const std::vector<Contender>& contenders);
void append(std::vector<Pose>& to, const std::vector<Pose>& more);

}  // namespace berth::estimator
