// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/view_acquisition.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "estimator/acquisition/beam_race.h"
#include "estimator/acquisition/point_sets.h"
#include "estimator/acquisition/scan_order.h"

namespace berth::estimator {

namespace {

std::vector<Pose> poses_of(const std::vector<Contender>& contenders) {
  std::vector<Pose> result;
  for (const Contender& c : contenders) result.push_back(c.pose);
  return result;
}

void append(std::vector<Pose>& to, const std::vector<Pose>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// Where the centroid of a target may be of which a part is hidden: in the middle, or all around.
std::vector<Vector3d> shifts_of_a_part(double length) {
  constexpr int around = 8;
  std::vector<Vector3d> shifts = {Vector3d::Zero()};
  for (int i = 0; i < around; ++i) {
    const double angle = radians(360) * i / around;
    shifts.emplace_back(0.15 * length * std::cos(angle), 0.15 * length * std::sin(angle), 0);
  }
  return shifts;
}

/// The search in one scan.
class Search {
 public:
  Search(const TargetModel& model, const BeamModel& beam_model,
         const ViewAcquisitionOptions& options, const CleanScan& scan,
         const std::vector<Hypothesis>& hints)
      : model_(model),
        options_(options),
        race_(model, beam_model, scan, hints),
        likelihood_(options.likelihood) {
    for (const Beam& beam : race_.returns()) returns_.push_back(beam.point());
  }

  /// The poses that may be it, distinct, best first. Empty only when there is nothing to weigh.
  std::vector<Contender> run(const std::vector<Hypothesis>& hints, const Vector3d& centroid);
  /// Why the pose cannot be right; empty when nothing speaks against it.
  std::string objection(const Contender& best) const;

  const BeamRace& race() const { return race_; }
  double noise_scale() const { return likelihood_.noise_scale; }
  int point_sets = 0;
  int candidates = 0;

 private:
  std::vector<Pose> look(const std::vector<Vector3d>& points, const Vector3d& centroid,
                         const std::vector<Vector3d>& shifts);
  std::vector<Contender> settle(std::vector<Pose> poses);
  std::vector<Contender> final_of(std::vector<Pose> poses);
  std::vector<Contender> look_in_parts(std::vector<Contender> so_far);
  bool in_one_place() const;
  bool explains_the_scan(const std::vector<Contender>& contenders) const;

  const TargetModel& model_;
  const ViewAcquisitionOptions& options_;
  BeamRace race_;
  LikelihoodOptions likelihood_;  // with the shares that the scan shows
  std::vector<Vector3d> returns_;
};

std::vector<Pose> Search::look(const std::vector<Vector3d>& points, const Vector3d& centroid,
                               const std::vector<Vector3d>& shifts) {
  ++point_sets;
  std::vector<Pose> poses;
  const auto count = static_cast<std::size_t>(options_.search.second_points);
  for (const Candidate& c :
       search_views(model_, spread_points(points, count), centroid, shifts, options_.search)) {
    poses.push_back(c.pose);
  }
  return race_.distinct(poses, static_cast<std::size_t>(options_.contenders), 1);
}

/// From rough poses to those few between which all beams decide.
std::vector<Contender> Search::settle(std::vector<Pose> poses) {
  constexpr std::size_t beams = 256;
  const double length = model_.target.length;
  const auto most = static_cast<std::size_t>(options_.finalists);
  LikelihoodOptions coarse = options_.likelihood;
  coarse.drop_out = std::max(coarse.drop_out, 0.1);
  coarse.outlier = std::max(coarse.outlier, 0.1);
  coarse.model_sigma_m = std::max(coarse.model_sigma_m, 0.006 * length);
  poses = poses_of(race_.run(poses, coarse, beams, beams));
  if (poses.size() > most) poses.resize(most);
  // A fit to few returns may go astray: the likelihood tells.
  append(poses, race_.fitted(poses, 256, 0.02 * length, 0.008 * length, 3));
  coarse.model_sigma_m = std::max(options_.likelihood.model_sigma_m, 0.003 * length);
  const std::vector<Contender> roughly = race_.run(poses, coarse, beams, beams);
  if (roughly.empty()) return {};
  likelihood_ = race_.as_seen_from(roughly.front(), options_.likelihood);
  poses = race_.distinct(poses_of(roughly), most, 0.7);
  append(poses, race_.fitted(poses, 400, 0.008 * length, 0.008 * length, 2));
  return final_of(
      race_.distinct(poses_of(race_.run(poses, likelihood_, 2 * beams, beams)), most, 0.7));
}

/// Poses, and what a target is confused with, itself turned, on all beams.
std::vector<Contender> Search::final_of(std::vector<Pose> poses) {
  constexpr std::size_t enough_beams = 1000;
  const std::size_t leaders = std::min<std::size_t>(poses.size(), 2);
  for (std::size_t i = 0; i < leaders; ++i) {
    for (const Symmetry& s : model_.symmetries.motions) {
      if (!s.exact) poses.push_back(poses[i] * s.motion);
    }
  }
  candidates += static_cast<int>(poses.size());
  return race_.distinct(race_.run(poses, likelihood_, race_.beams(), enough_beams), 0.7);
}

bool Search::in_one_place() const {
  return std::all_of(returns_.begin(), returns_.end(), [&](const Vector3d& p) {
    return (p - returns_.front()).norm() < 0.02 * model_.target.length;
  });
}

bool Search::explains_the_scan(const std::vector<Contender>& contenders) const {
  constexpr double well = 0.75;
  return !contenders.empty() && objection(contenders.front()).empty() &&
         race_.explained_share(contenders.front()) > well;
}

/// Something else is in the scan: each guess of which returns are the target's has its own winner,
/// and of those against which nothing speaks all beams choose. Two that agree need no third.
std::vector<Contender> Search::look_in_parts(std::vector<Contender> so_far) {
  std::vector<Pose> possible;
  std::vector<Pose> winners;
  bool agreed = false;
  const auto add = [&](const std::vector<Contender>& contenders) {
    if (contenders.empty() || !objection(contenders.front()).empty()) return;
    agreed = std::any_of(winners.begin(), winners.end(), [&](const Pose& other) {
      return race_.same(contenders.front().pose, other, 0.7);
    });
    winners.push_back(contenders.front().pose);
    append(possible, poses_of(contenders));
  };
  add(so_far);
  const TargetSize size{0.5 * model_.target.length, model_.radius};
  const auto sets =
      candidate_point_sets(returns_, size, static_cast<std::size_t>(options_.point_sets));
  for (const bool hidden : {false, true}) {
    if (hidden && !possible.empty()) break;
    for (const PointSet& set : sets) {
      if (agreed) break;
      add(settle(look(set.points, set.centroid,
                      hidden ? shifts_of_a_part(model_.target.length)
                             : std::vector<Vector3d>{Vector3d::Zero()})));
    }
  }
  if (possible.empty()) return so_far;
  // The centroid of a part may be far from where a view expects it: the fit has a longer way.
  const double length = model_.target.length;
  possible = race_.distinct(possible, static_cast<std::size_t>(options_.contenders), 0.7);
  append(possible, race_.fitted(possible, 800, 0.06 * length, 0.008 * length, 10));
  const std::vector<Contender> roughly = race_.run(possible, options_.likelihood, 512, 512);
  likelihood_ = race_.as_seen_from(roughly.front(), options_.likelihood);
  return final_of(
      race_.distinct(poses_of(roughly), static_cast<std::size_t>(options_.finalists), 0.7));
}

std::vector<Contender> Search::run(const std::vector<Hypothesis>& hints, const Vector3d& centroid) {
  if (!hints.empty()) {
    std::vector<Pose> poses;
    for (const Hypothesis& h : hints) poses.push_back(h.pose);
    std::vector<Contender> found = settle(poses);
    if (explains_the_scan(found)) return found;
  }
  if (static_cast<int>(returns_.size()) < options_.least_returns || in_one_place()) return {};
  std::vector<Contender> found = settle(look(returns_, centroid, {Vector3d::Zero()}));
  return explains_the_scan(found) ? found : look_in_parts(std::move(found));
}

std::string Search::objection(const Contender& best) const {
  const Likelihood& fit = best.weight.sum();
  if (const double lead = race_.evidence(best, likelihood_); lead < options_.least_evidence) {
    return "the best fit explains the scan hardly better than no target: log-likelihood " +
           fixed(lead, 0) + " more, at least " + fixed(options_.least_evidence, 0) + " is needed";
  }
  const double visible = std::max(1, fit.predicted - fit.occluded());
  if (fit.explained < options_.least_explained * visible) {
    return "only " + fixed(100 * fit.explained / visible, 0) +
           " % of the beams that the best fit puts on the target return from it, at least " +
           fixed(100 * options_.least_explained, 0) + " % are needed";
  }
  if (fit.explained < options_.least_in_view * fit.predicted) {
    return "something hides " + fixed(100.0 * fit.occluded() / std::max(1, fit.predicted), 0) +
           " % of the best fit; at least " + fixed(100 * options_.least_in_view, 0) +
           " % have to be seen";
  }
  if (const double share = race_.misfit_share(best, likelihood_);
      share > options_.most_misfit_share) {
    return fixed(100 * share, 0) +
           " % of the returns on the best fit's surface go on beside it, at most " +
           fixed(100 * options_.most_misfit_share, 0) + " % may";
  }
  if (const double share = race_.inlier_share(best); share < options_.least_inlier_share) {
    return "only " + fixed(100 * share, 0) +
           " % of the returns about the best fit belong to it, at least " +
           fixed(100 * options_.least_inlier_share, 0) + " % are needed";
  }
  return "";
}

}  // namespace

AcquisitionResult ViewAcquisition::acquire(const CleanScan& scan,
                                           const std::vector<Hypothesis>& hints) const {
  AcquisitionResult result;
  Vector3d centroid = Vector3d::Zero();
  for (const Vector3d& p : scan.points) centroid += p;
  if (!scan.points.empty()) centroid /= static_cast<double>(scan.points.size());
  Search search(model_, beam_model_, options_, scan, hints);
  const std::vector<Contender> found = search.run(hints, centroid);
  result.noise_scale = search.noise_scale();
  result.point_sets = search.point_sets;
  result.candidates = search.candidates;
  if (found.empty()) {
    result.reason = std::to_string(scan.points.size()) +
                    " returns inside the range gate, at least " +
                    std::to_string(options_.least_returns) + " from more than one place are needed";
    return result;
  }

  const double best = found.front().log_likelihood();
  double sum = 0;
  for (const Contender& c : found) sum += std::exp(c.log_likelihood() - best);
  for (const Contender& c : found) {
    if (static_cast<int>(result.hypotheses.size()) == options_.most_hypotheses) break;
    Hypothesis h;
    h.pose = c.pose;
    h.log_likelihood = c.log_likelihood();
    h.probability = std::exp(c.log_likelihood() - best) / sum;
    h.fit = c.weight.sum();
    h.inlier_share = search.race().inlier_share(c);
    h.equal_poses = model_.symmetries.exact_count();
    h.constrained = true;
    result.hypotheses.push_back(h);
  }
  result.reason = search.objection(found.front());
  if (!result.reason.empty()) return result;
  if (found.size() > 1 && best - found[1].log_likelihood() < options_.decisive_margin) {
    result.status = AcquisitionResult::Status::ambiguous;
    result.reason = "two poses explain the scan nearly equally well: log-likelihoods differ by " +
                    fixed(best - found[1].log_likelihood(), 1) + ", " +
                    fixed(options_.decisive_margin, 1) + " decide";
    return result;
  }
  result.status = AcquisitionResult::Status::found;
  return result;
}

}  // namespace berth::estimator
