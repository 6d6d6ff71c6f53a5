// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/trials/self_match.h"

#include <algorithm>
#include <limits>

#include "common/core/random.h"

namespace berth::trials {
namespace {

bool has_near(const std::vector<Pose>& poses, const Pose& pose, double angle) {
  return std::any_of(poses.begin(), poses.end(),
                     [&](const Pose& p) { return angle_between(p, pose) < angle; });
}

}  // namespace

std::vector<SelfMatch> self_matches(const estimator::TargetModel& model, std::size_t max_matches) {
  const SelfMatcher matcher(model.caster);
  Random random(2, "self-match");
  struct Candidate {
    double score;
    Pose motion;
  };
  std::vector<Candidate> candidates;
  for (int i = 0; i < 8000; ++i) {
    const Pose motion = matcher.turned(random.rotation());
    candidates.push_back({matcher.score(motion, 60), motion});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score < b.score; });
  std::vector<Pose> tried = {Pose{}};
  std::vector<Pose> found = {Pose{}};
  std::vector<SelfMatch> matches;
  for (const Candidate& candidate : candidates) {
    if (tried.size() > 300) break;
    if (has_near(tried, candidate.motion, radians(8))) continue;
    tried.push_back(candidate.motion);
    const Pose coarse = matcher.refined(candidate.motion, 200, 15);
    if (has_near(found, coarse, radians(3))) continue;
    found.push_back(coarse);
    matches.push_back({coarse, matcher.score(coarse, 400)});
  }
  const auto better = [](const SelfMatch& a, const SelfMatch& b) {
    return a.residual < b.residual;
  };
  std::stable_sort(matches.begin(), matches.end(), better);
  matches.resize(std::min(matches.size(), 3 * max_matches));
  for (SelfMatch& match : matches) {
    match.motion = matcher.refined(match.motion, 1500, 40);
    match.residual =
        matcher.residual(match.motion, matcher.points(), std::numeric_limits<double>::infinity());
  }
  std::stable_sort(matches.begin(), matches.end(), better);
  std::vector<Pose> kept = {Pose{}};
  std::erase_if(matches, [&kept](const SelfMatch& match) {  // that ended in one place
    if (has_near(kept, match.motion, radians(6))) return true;
    kept.push_back(match.motion);
    return false;
  });
  matches.resize(std::min(matches.size(), max_matches));
  return matches;
}

PoseJudge::PoseJudge(const estimator::TargetModel& model)
    : centre_(model.centre),
      tolerance_m_(0.05 * model.target.length),
      symmetry_(find_symmetry(model.caster)) {
  for (const SelfMatch& match : self_matches(model, 30)) {
    if (!symmetry_.contains(match.motion, radians(3))) near_.push_back(match.motion);
  }
  near_.resize(std::min<std::size_t>(near_.size(), 12));
}

bool PoseJudge::right(const Pose& truth, const Pose& pose) const {
  const Pose equal = nearest_equal(truth, pose);
  return angle_between(equal, pose) <= radians(5) &&
         (equal * centre_ - pose * centre_).norm() <= tolerance_m_;
}

std::vector<Pose> PoseJudge::rivals(const Pose& truth) const {
  std::vector<Pose> rivals;
  for (const Pose& motion : near_) rivals.push_back(truth * motion);
  return rivals;
}

}  // namespace berth::trials
