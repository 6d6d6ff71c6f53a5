// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/view_acquisition.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "estimator/acquisition/contest.h"
#include "estimator/acquisition/objection.h"
#include "estimator/acquisition/point_sets.h"
#include "estimator/acquisition/scan_order.h"

namespace berth::estimator {

namespace {

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
        contest_(model, options, race_) {
    for (const Beam& beam : race_.returns()) returns_.push_back(beam.point());
  }

  /// The poses that may be it, distinct, best first. Empty only when there is nothing to weigh.
  std::vector<Contender> run(const std::vector<Hypothesis>& hints, const Vector3d& centroid);
  /// Why the pose cannot be right; empty when nothing speaks against it.
  std::string objection(const Contender& best) const {
    return estimator::objection(race_, best, contest_.likelihood(), options_);
  }

  const BeamRace& race() const { return race_; }
  const Contest& contest() const { return contest_; }
  int point_sets = 0;

 private:
  std::vector<Pose> look(const std::vector<Vector3d>& points, const Vector3d& centroid,
                         const std::vector<Vector3d>& shifts);
  std::vector<Contender> look_at_all(const Vector3d& centroid);
  std::vector<Contender> look_in_parts(std::vector<Contender> so_far);
  bool in_one_place() const;
  bool explains_the_scan(const std::vector<Contender>& contenders) const;

  const TargetModel& model_;
  const ViewAcquisitionOptions& options_;
  BeamRace race_;
  Contest contest_;
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

bool Search::in_one_place() const {
  return std::all_of(returns_.begin(), returns_.end(), [&](const Vector3d& p) {
    return (p - returns_.front()).norm() < 0.02 * model_.target.length;
  });
}

bool Search::explains_the_scan(const std::vector<Contender>& contenders) const {
  return !contenders.empty() && explains_most(race_, contenders.front()) &&
         objection(contenders.front()).empty();
}

/// Everything may be the target's.
std::vector<Contender> Search::look_at_all(const Vector3d& centroid) {
  constexpr std::size_t more_effort = 4;
  std::vector<Pose> rough = look(returns_, centroid, {Vector3d::Zero()});
  std::vector<Contender> found = contest_.settle(rough);
  if (found.empty() || !contest_.unresolved(found.front())) return found;
  append(rough, poses_of(found));
  return contest_.settle(std::move(rough), more_effort);
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
      return race_.same(contenders.front().pose, other, BeamRace::one_place);
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
      add(contest_.settle(look(set.points, set.centroid,
                               hidden ? shifts_of_a_part(model_.target.length)
                                      : std::vector<Vector3d>{Vector3d::Zero()})));
    }
  }
  if (possible.empty()) return so_far;
  // The centroid of a part may be far from where a view expects it: the fit has a longer way.
  const double length = model_.target.length;
  possible =
      race_.distinct(possible, static_cast<std::size_t>(options_.contenders), BeamRace::one_place);
  append(possible, race_.fitted(possible, 800, 0.06 * length, 0.008 * length, 10));
  const std::vector<Contender> roughly = race_.run(possible, options_.likelihood, 512, 512);
  contest_.look_from(roughly.front());
  return contest_.decide(race_.distinct(
      poses_of(roughly), static_cast<std::size_t>(options_.finalists), BeamRace::one_place));
}

std::vector<Contender> Search::run(const std::vector<Hypothesis>& hints, const Vector3d& centroid) {
  if (!hints.empty()) {
    std::vector<Pose> poses;
    for (const Hypothesis& h : hints) poses.push_back(h.pose);
    std::vector<Contender> found = contest_.settle(poses);
    if (explains_the_scan(found)) return found;
  }
  if (static_cast<int>(returns_.size()) < options_.least_returns || in_one_place()) return {};
  std::vector<Contender> found = look_at_all(centroid);
  return explains_the_scan(found) ? found : look_in_parts(std::move(found));
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
  result.noise_scale = search.contest().likelihood().noise_scale;
  result.point_sets = search.point_sets;
  result.candidates = search.contest().candidates();
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
    const double needed = search.contest().decisive_lead(found.front(), found[i]);
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
