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

/// Share of the beams past the target's rim that may be stopped beside it.
constexpr double most_at_rim = 0.15;
/// Log-likelihood that a beam against a look-alike may cost it for want of polish alone.
constexpr double unsettled = 4;

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

  /// Whether what is about the target is something else: nearly all beams that should meet the
  /// target do, and nearly all that pass its rim go on.
  bool stands_clear(const Contender& best) const;

  double decisive_lead(const Contender& best, const Contender& other) const;

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
  bool looks_alike(const Symmetry& symmetry) const;
  bool crisp(const Contender& contender) const;
  bool in_one_place() const;
  bool explains_most(const Contender& contender) const;
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

/// Poses, and what a target is confused with, itself turned, on all beams. A lead is worth no more
/// than the poses are settled: what wins no clear victory is polished, and races again.
std::vector<Contender> Search::final_of(std::vector<Pose> poses) {
  constexpr std::size_t enough_beams = 1000;
  constexpr std::size_t polishing_beams = 2000;
  constexpr std::size_t most_left = 4;
  const std::vector<Symmetry>& motions = model_.symmetries.motions;
  const bool has_alike = std::any_of(motions.begin(), motions.end(),
                                     [&](const Symmetry& s) { return looks_alike(s); });
  const auto race = [&](std::size_t leaders) {
    for (std::size_t i = 0; i < leaders; ++i) {
      for (const Symmetry& s : motions) {
        if (!s.exact) poses.push_back(poses[i] * s.motion);
      }
    }
    candidates += static_cast<int>(poses.size());
    return race_.distinct(
        race_.run(poses, likelihood_, race_.beams(), enough_beams, has_alike ? unsettled : 0), 0.7);
  };
  const std::vector<Contender> found = race(std::min<std::size_t>(poses.size(), 2));
  if (found.empty() || (found.size() == 1 && !has_alike && crisp(found.front()))) return found;
  std::vector<Pose> left = poses_of(found);
  if (left.size() > most_left) left.resize(most_left);
  poses.clear();
  for (const Pose& pose : left) {
    poses.push_back(race_.polished(pose, likelihood_, polishing_beams, {}));
  }
  append(poses, left);
  return race(1);
}

bool Search::looks_alike(const Symmetry& symmetry) const {
  constexpr double least_unlike = 0.007;  // of the length, rms
  return !symmetry.exact && symmetry.deviation_m < least_unlike * model_.target.length;
}

/// Log-likelihood by which the best must lead another pose.
double Search::decisive_lead(const Contender& best, const Contender& other) const {
  const bool alike = std::any_of(
      model_.symmetries.motions.begin(), model_.symmetries.motions.end(), [&](const Symmetry& s) {
        return looks_alike(s) && race_.same(best.pose * s.motion, other.pose, 2);
      });
  if (!alike) return options_.decisive_margin;
  const int strays =
      std::max(0, other.weight.sum().past_returned - best.weight.sum().past_returned);
  return options_.decisive_margin + unsettled * (1 + strays + other.contradictions());
}

/// Whether nearly all beams that should meet the target do, but for what hides it.
bool Search::crisp(const Contender& contender) const {
  // More noise than the LIDAR says explains what it likes.
  const double nearly_all = likelihood_.noise_scale > 1 ? 0.97 : 0.93;
  const Likelihood& fit = contender.weight.sum();
  return fit.explained > nearly_all * (fit.predicted - fit.occluded());
}

bool Search::in_one_place() const {
  return std::all_of(returns_.begin(), returns_.end(), [&](const Vector3d& p) {
    return (p - returns_.front()).norm() < 0.02 * model_.target.length;
  });
}

bool Search::explains_most(const Contender& contender) const {
  constexpr double most = 0.75;
  return race_.explained_share(contender) > most;
}

bool Search::explains_the_scan(const std::vector<Contender>& contenders) const {
  return !contenders.empty() && explains_most(contenders.front()) &&
         objection(contenders.front()).empty();
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

bool Search::stands_clear(const Contender& best) const {
  constexpr double least_inliers = 0.5;
  return crisp(best) && race_.inlier_share(best) > least_inliers &&
         race_.rim_share(best) < most_at_rim;
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
  const double scanned = race_.scanned_share(best);
  if (const double seen = scanned * fit.explained / std::max(1, fit.predicted);
      seen < options_.least_in_view) {
    return "something hides " + fixed(100.0 * fit.occluded() / std::max(1, fit.predicted), 0) +
           " % of the best fit, and " + fixed(100 * (1 - scanned), 0) +
           " % of it lie outside the scan; at least " + fixed(100 * options_.least_in_view, 0) +
           " % have to be seen";
  }
  // What fits a part of the scan only, and that not well, may fit by chance.
  if (!explains_most(best) && !crisp(best)) {
    if (const double share = race_.rim_share(best); share > most_at_rim) {
      return fixed(100 * share, 0) +
             " % of the beams that pass the best fit closely are stopped beside it, at most " +
             fixed(100 * most_at_rim, 0) + " % may";
    }
    if (likelihood_.noise_scale > 1) {
      return "the best fit explains a part of the scan only, and needs " +
             fixed(likelihood_.noise_scale, 1) + " times the noise that the LIDAR says";
    }
  }
  if (stands_clear(best)) return "";
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
  for (std::size_t i = 1; i < found.size(); ++i) {
    const double lead = best - found[i].log_likelihood();
    const double needed = search.decisive_lead(found.front(), found[i]);
    if (lead >= needed) continue;
    result.status = AcquisitionResult::Status::ambiguous;
    result.reason = "two poses explain the scan nearly equally well: log-likelihoods differ by " +
                    fixed(lead, 1) + ", " + fixed(needed, 1) + " decide";
    return result;
  }
  result.status = AcquisitionResult::Status::found;
  return result;
}

}  // namespace berth::estimator
