// SPDX-License-Identifier: BSD-3-Clause
#include "common/meshes/symmetry.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "common/core/config.h"
#include "common/core/random.h"

namespace berth {
namespace {

constexpr std::size_t sample_size = 20000;

/// First hits of random lines: visible points, weighted by visible area.
std::vector<Vector3d> visible_points(const RayCaster& surface) {
  const Vector3d centre = surface.bounds().centre();
  const double radius = surface.bounds().size().norm() / 2;
  Random random(1, "self-match");
  std::vector<Vector3d> points;
  for (std::size_t tries = 0; points.size() < sample_size && tries < 1000 * sample_size; ++tries) {
    const Quaterniond view = random.rotation();
    const Vector3d across(random.uniform(-1, 1), random.uniform(-1, 1), -3);
    const Ray ray{centre + radius * (view * across), view * Vector3d::UnitZ()};
    RayHit hit;
    if (surface.cast(ray, 10 * radius, hit)) {
      points.push_back(ray.origin + hit.range * ray.direction);
    }
  }
  return points;
}

/// Turn about a line.
Pose about(const SymmetryGroup::Axis& axis, double angle) {
  const Quaterniond rotation = rotation_from_vector(angle * axis.direction);
  return {axis.point - rotation * axis.point, rotation};
}

/// The turn about a direction in a rotation, rad (swing-twist decomposition).
double twist(const Quaterniond& rotation, const Vector3d& direction) {
  return 2 * std::atan2(rotation.vec().dot(direction), rotation.w());
}

/// The line about which a motion turns; of a screw its axis.
SymmetryGroup::Axis axis_of(const Pose& motion, const Vector3d& near) {
  const Vector3d direction = rotation_vector(motion.rotation).normalized();
  const Matrix3d moves = Matrix3d::Identity() - motion.rotation.toRotationMatrix();
  // Singular along the axis, where the point may be anywhere: as near as it can be.
  const Matrix3d regular = moves + direction * direction.transpose();
  const Vector3d off = motion * near - near;
  const Vector3d across = off - direction * direction.dot(off);
  return {near + regular.partialPivLu().solve(across), direction};
}

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.10g", value == 0 ? 0 : value);
  return text;
}

}  // namespace

Pose SymmetryGroup::nearest_equal(const Pose& pose, const Pose& reference) const {
  Pose best = pose;
  double min_angle = std::numeric_limits<double>::infinity();
  const auto consider = [&](const Pose& any) {
    const Pose equal = turned_to(any, reference);
    const double angle = angle_between(equal, reference);
    if (angle >= min_angle) return;
    min_angle = angle;
    best = equal;
  };
  if (trivial()) return pose;
  consider(pose);
  for (const Pose& motion : motions) consider(pose * motion);
  return best;
}

bool SymmetryGroup::contains(const Pose& motion, double angle) const {
  const auto is = [&](const Pose& known) {
    return angle_between(turned_to(motion, known), known) < angle;
  };
  return is(Pose{}) || std::any_of(motions.begin(), motions.end(), is);
}

Pose SymmetryGroup::turned_to(const Pose& pose, const Pose& reference) const {
  if (!revolution) return pose;
  const Quaterniond away = reference.rotation.conjugate() * pose.rotation;
  return pose * about(*revolution, -twist(away, revolution->direction));
}

SymmetryGroup SymmetryGroup::keeping(const Vector3d& point, const Vector3d& direction) const {
  const auto keeps = [&](const Pose& motion) {
    const double turned = std::atan2((motion.rotation * direction).cross(direction).norm(),
                                     (motion.rotation * direction).dot(direction));
    return (motion * point - point).norm() <= tolerance_m && turned <= radians(1);
  };
  SymmetryGroup kept{{}, {}, tolerance_m};
  std::copy_if(motions.begin(), motions.end(), std::back_inserter(kept.motions), keeps);
  if (revolution && keeps(about(*revolution, radians(90)))) {
    kept.revolution = revolution;
  }
  return kept;
}

SelfMatcher::SelfMatcher(const RayCaster& surface)
    : surface_(surface),
      length_(surface.bounds().size().maxCoeff()),
      points_(visible_points(surface)) {
  const auto n = static_cast<double>(std::max<std::size_t>(points_.size(), 1));
  for (const Vector3d& p : points_) centroid_ += p / n;
  double fourth = 0;
  for (const Vector3d& p : points_) {
    const Vector3d q = p - centroid_;
    moments_ += q * q.transpose() / n;
    fourth += q.squaredNorm() * q.squaredNorm() / n;
  }
  moments_sigma_ = std::sqrt(std::max(0.0, fourth - moments_.squaredNorm()) / n);
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(moments_);
  moments_range_ = principal.eigenvalues()(2) - principal.eigenvalues()(0);
}

Pose SelfMatcher::turned(const Quaterniond& rotation) const {
  return {centroid_ - rotation * centroid_, rotation};
}

bool SelfMatcher::may_be_near_symmetry(const Quaterniond& rotation, double slack) const {
  const Matrix3d r = rotation.toRotationMatrix();
  // A turn by the slack changes a tensor by at most sqrt(2) times its range times the sine.
  const double by_slack = std::sqrt(2.0) * moments_range_ * std::sin(std::min(slack, radians(90)));
  return (r * moments_ * r.transpose() - moments_).norm() <= by_slack + 5 * moments_sigma_;
}

double SelfMatcher::score(const Pose& motion, std::size_t points) const {
  double sum = 0;
  for (std::size_t i = 0; i < points; ++i) {
    const Vector3d moved = motion * points_[i];
    sum += std::min((surface_.nearest(moved) - moved).norm(), 0.1 * length_);
  }
  return sum / static_cast<double>(points);
}

Pose SelfMatcher::refined(Pose motion, std::size_t points, int iterations) const {
  for (int i = 0; i < iterations; ++i) {
    Matrix6d normal = 1e-6 * static_cast<double>(points) * Matrix6d::Identity();
    Vector6d gradient = Vector6d::Zero();
    const Vector3d middle = motion * centroid_;
    for (std::size_t k = 0; k < points; ++k) {
      const Vector3d moved = motion * points_[k];
      const Vector3d off = moved - surface_.nearest(moved);
      const double distance = off.norm();
      if (distance < 1e-12 || distance > 0.2 * length_) continue;
      const Vector3d along = off / distance;
      Vector6d jacobian;
      jacobian << along, (moved - middle).cross(along) / length_;
      normal += jacobian * jacobian.transpose();
      gradient += distance * jacobian;
    }
    Vector6d step = -normal.ldlt().solve(gradient);
    step.tail<3>() /= length_;
    const Quaterniond turn = rotation_from_vector(step.tail<3>());
    motion = Pose{middle + step.head<3>() - turn * middle, turn} * motion;
    if (step.head<3>().norm() < 1e-9 * length_ && step.tail<3>().norm() < 1e-9) break;
  }
  return motion;
}

double SelfMatcher::residual(const Pose& motion, std::size_t points, double enough) const {
  double max_distance = 0;
  for (std::size_t i = 0; i < std::min(points, points_.size()) && max_distance <= enough; ++i) {
    const Vector3d moved = motion * points_[i];
    max_distance = std::max(max_distance, (surface_.nearest(moved) - moved).norm());
  }
  return max_distance;
}

namespace {

/// Builds a group: with a motion, all its products with the others are added.
class Collector {
 public:
  explicit Collector(const SelfMatcher& matcher) : matcher_(matcher) {
    group_.tolerance_m = symmetry_tolerance * matcher.length();
  }

  const SymmetryGroup& group() const { return group_; }
  bool is_full() const { return group_.motions.size() >= max_motions; }
  bool knows(const Pose& motion) const { return group_.contains(motion, same); }

  /// Adds the motion that this one is refined to, if it is a symmetry.
  void consider(const Pose& coarse, std::size_t points) {
    const Pose motion = matcher_.refined(coarse, 1500, 10);
    if (is_full() || knows(motion) || !is_symmetry(motion, points)) return;
    look_for_axis(motion);
    if (knows(motion)) return;
    group_.motions.push_back(motion);
    // Products of symmetries are symmetries: a few points suffice to detect accumulated errors.
    for (std::size_t i = 0; i < group_.motions.size(); ++i) {
      for (const Pose& product : {group_.motions[i] * motion, motion * group_.motions[i]}) {
        if (!knows(product)) consider(product, 1000);
      }
    }
  }

 private:
  static constexpr std::size_t max_motions = 120;
  static constexpr double same = radians(1);

  bool is_symmetry(const Pose& motion, std::size_t points) const {
    return matcher_.residual(motion, points, group_.tolerance_m) <= group_.tolerance_m;
  }

  void look_for_axis(const Pose& motion) {
    constexpr double golden_angle = 2.399963229728653;
    if (group_.revolution) return;
    const SymmetryGroup::Axis axis = axis_of(motion, matcher_.centroid());
    for (int i = 1; i <= 10; ++i) {
      if (!is_symmetry(about(axis, i * golden_angle), 2000)) return;
    }
    group_.revolution = axis;
    const std::vector<Pose> before = std::exchange(group_.motions, {});
    for (const Pose& known : before) {
      if (!knows(known)) group_.motions.push_back(known);
    }
  }

  const SelfMatcher& matcher_;
  SymmetryGroup group_;
};

}  // namespace

SymmetryGroup find_symmetry(const RayCaster& surface) {
  constexpr int rotations = 8000;
  constexpr double slack = radians(17);  // no rotation is farther from one of so many
  constexpr double apart = radians(8);   // starts nearer to each other converge to the same motion
  constexpr std::size_t max_tried = 300;

  const SelfMatcher matcher(surface);
  Collector collector(matcher);
  if (matcher.points() < sample_size) return collector.group();  // next to nothing can be seen

  struct Start {
    Pose motion;
    double score;
  };
  std::vector<Start> starts;
  Random random(2, "self-match");
  for (int i = 0; i < rotations; ++i) {
    const Quaterniond rotation = random.rotation();
    if (!matcher.may_be_near_symmetry(rotation, slack)) continue;
    const Pose motion = matcher.turned(rotation);
    starts.push_back({motion, matcher.score(motion, 60)});
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const Start& a, const Start& b) { return a.score < b.score; });
  std::vector<Pose> tried;
  for (const Start& start : starts) {
    const auto is_near = [&](const Pose& p) { return angle_between(p, start.motion) < apart; };
    if (tried.size() == max_tried || collector.is_full()) break;
    if (std::any_of(tried.begin(), tried.end(), is_near) ||
        collector.group().contains(start.motion, apart)) {
      continue;
    }
    tried.push_back(start.motion);
    const Pose coarse = matcher.refined(start.motion, 200, 10);
    const double enough = 2 * collector.group().tolerance_m;
    if (matcher.residual(coarse, 400, enough) > enough || collector.knows(coarse)) continue;
    collector.consider(coarse, matcher.points());
  }
  return collector.group();
}

std::string yaml_of(const SymmetryGroup& group) {
  std::string text =
      "# Motions of the model frame that carry the target's visible surface onto itself: x y z w p "
      "r in mm and\n# degrees. Poses that they carry into each other are one to the verdict.\n";
  text += "tolerance: " + number(1e3 * group.tolerance_m) + " mm\n";
  if (group.revolution) {
    const auto& [point, direction] = *group.revolution;
    text += "revolution:\n  point: [";
    for (int i = 0; i < 3; ++i) text += (i == 0 ? "" : ", ") + number(1e3 * point[i]) + " mm";
    text += "]\n  direction: [";
    for (int i = 0; i < 3; ++i) text += (i == 0 ? "" : ", ") + number(direction[i]);
    text += "]\n";
  }
  text += group.motions.empty() ? "motions: []\n" : "motions:\n";
  for (const Pose& motion : group.motions) {
    const Xyzwpr coordinates = xyzwpr_from_pose(motion);
    text += "  - pose: [";
    for (std::size_t i = 0; i < 6; ++i) {
      text += (i == 0 ? "" : ", ") + number(std::round(1e6 * coordinates[i]) / 1e6);
    }
    text += "]\n";
  }
  return text;
}

SymmetryGroup read_symmetry(const std::string& yaml, const std::string& name) {
  Config config = Config::parse(yaml, name);
  SymmetryGroup group;
  group.tolerance_m = config.quantity("tolerance", Dimension::length);
  if (config.has("revolution")) {
    Config axis = config.section("revolution");
    group.revolution = {axis.vector("point", Dimension::length),
                        axis.vector("direction", Dimension::number)};
    if (std::abs(group.revolution->direction.norm() - 1) > 1e-6) {
      throw axis.error("direction", "expected a vector of length 1");
    }
    group.revolution->direction.normalize();
    axis.finish();
  }
  for (Config& motion : config.sections("motions")) {
    group.motions.push_back(motion.pose("pose"));
    motion.finish();
  }
  for (const Pose& motion : group.motions) {
    const auto is_back = [&](const Pose& known) {
      const Pose back = group.turned_to(motion.inverse(), known);
      return angle_between(back, known) < radians(0.1) &&
             distance(back, known) <= 2 * group.tolerance_m;
    };
    if (std::none_of(group.motions.begin(), group.motions.end(), is_back)) {
      throw config.error("motions", "the way back of one of them is missing");
    }
  }
  config.finish();
  return group;
}

}  // namespace berth
