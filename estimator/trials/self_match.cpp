// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/trials/self_match.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "common/core/random.h"
namespace berth::trials {
namespace {

using Points = std::vector<Vector3d>;

/// First hits of random lines: what can be seen, weighed by how much of it is.
Points visible_points(const estimator::TargetModel& model, std::size_t count) {
  Random random(1, "self-match");
  Points points;
  for (std::size_t tries = 0; points.size() < count && tries < 1000 * count; ++tries) {
    const Quaterniond view = random.rotation();
    const Vector3d across(random.uniform(-1, 1), random.uniform(-1, 1), -3);
    const Ray ray{model.centre + model.radius * (view * across), view * Vector3d::UnitZ()};
    RayHit hit;
    if (model.caster.cast(ray, 10 * model.radius, hit)) {
      points.push_back(ray.origin + hit.range * ray.direction);
    }
  }
  return points;
}

class Matcher {
 public:
  explicit Matcher(const estimator::TargetModel& model)
      : model_(model), points_(visible_points(model, 20000)) {
    for (const Vector3d& p : points_) centroid_ += p / static_cast<double>(points_.size());
  }

  /// Turned about the centroid, which a true symmetry leaves where it is.
  Pose turned(const Quaterniond& rotation) const {
    return {centroid_ - rotation * centroid_, rotation};
  }

  /// Mean distance from the surface, cut off at a tenth of the length.
  double score(const Pose& motion, std::size_t points) const {
    double sum = 0;
    for (std::size_t i = 0; i < points; ++i) {
      const Vector3d moved = motion * points_[i];
      sum += std::min((model_.caster.nearest(moved) - moved).norm(), 0.1 * model_.target.length);
    }
    return sum / static_cast<double>(points);
  }

  Pose refined(Pose motion, std::size_t points, int iterations) const {
    const auto n = static_cast<Eigen::Index>(points);
    Eigen::Matrix3Xd from(3, n);
    Eigen::Matrix3Xd to(3, n);
    for (int i = 0; i < iterations; ++i) {
      for (Eigen::Index k = 0; k < n; ++k) {
        from.col(k) = points_[static_cast<std::size_t>(k)];
        to.col(k) = model_.caster.nearest(motion * from.col(k));
      }
      const Eigen::Matrix4d fit = Eigen::umeyama(from, to, false);
      const Pose next{fit.topRightCorner<3, 1>(), Quaterniond(fit.topLeftCorner<3, 3>())};
      const bool still = distance(motion, next) < 1e-6 && angle_between(motion, next) < 1e-6;
      motion = next;
      if (still) break;
    }
    return motion;
  }

  double misfit(const Pose& motion) const {
    double most = 0;
    for (const Vector3d& p : points_) {
      const Vector3d moved = motion * p;
      most = std::max(most, (model_.caster.nearest(moved) - moved).norm());
    }
    return most;
  }

 private:
  const estimator::TargetModel& model_;
  Points points_;
  Vector3d centroid_ = Vector3d::Zero();
};

bool has_near(const std::vector<Pose>& poses, const Pose& pose, double angle) {
  return std::any_of(poses.begin(), poses.end(),
                     [&](const Pose& p) { return angle_between(p, pose) < angle; });
}

}  // namespace

std::vector<SelfMatch> self_matches(const estimator::TargetModel& model, std::size_t most) {
  const Matcher matcher(model);
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
  const auto better = [](const SelfMatch& a, const SelfMatch& b) { return a.misfit < b.misfit; };
  std::stable_sort(matches.begin(), matches.end(), better);
  matches.resize(std::min(matches.size(), 3 * most));
  for (SelfMatch& match : matches) {
    match.motion = matcher.refined(match.motion, 1500, 40);
    match.misfit = matcher.misfit(match.motion);
  }
  std::stable_sort(matches.begin(), matches.end(), better);
  std::vector<Pose> kept = {Pose{}};
  std::erase_if(matches, [&kept](const SelfMatch& match) {  // that ended in one place
    if (has_near(kept, match.motion, radians(6))) return true;
    kept.push_back(match.motion);
    return false;
  });
  matches.resize(std::min(matches.size(), most));
  return matches;
}

PoseJudge::PoseJudge(const estimator::TargetModel& model)
    : centre_(model.centre), tolerance_m_(0.05 * model.target.length) {
  symmetries_ = {Pose{}};
  for (const SelfMatch& match : self_matches(model, 30)) {
    const bool exact = match.misfit <= 0.002 * model.target.length;
    (exact ? symmetries_ : near_).push_back(match.motion);
  }
  near_.resize(std::min<std::size_t>(near_.size(), 12));
}

bool PoseJudge::right(const Pose& truth, const Pose& pose) const {
  return std::any_of(symmetries_.begin(), symmetries_.end(), [&](const Pose& motion) {
    const Pose equal = truth * motion;
    return angle_between(equal, pose) <= radians(5) &&
           (equal * centre_ - pose * centre_).norm() <= tolerance_m_;
  });
}

std::vector<Pose> PoseJudge::rivals(const Pose& truth) const {
  std::vector<Pose> rivals;
  for (const Pose& motion : near_) rivals.push_back(truth * motion);
  return rivals;
}

Pose PoseJudge::nearest_equal(const Pose& truth, const Pose& pose) const {
  Pose nearest = truth;
  for (const Pose& motion : symmetries_) {
    const Pose equal = truth * motion;
    if (angle_between(equal, pose) < angle_between(nearest, pose)) nearest = equal;
  }
  return nearest;
}

}  // namespace berth::trials
