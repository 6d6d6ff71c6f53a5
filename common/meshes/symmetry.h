// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/pose.h"
#include "common/core/ray_caster.h"

namespace berth {

/// The proper rigid motions of a model frame that carry a target's visible surface onto itself. Two
/// poses T_sensor_model that such a motion carries into each other show the same surface: criteria
/// and comparisons treat them as equal. An empty group: only the identity.
struct SymmetryGroup {
  struct Axis {
    Vector3d point;      ///< m, model frame
    Vector3d direction;  ///< unit
  };
  /// Model frame to model frame, without the identity; with an axis of revolution modulo turns
  /// about it.
  std::vector<Pose> motions;
  std::optional<Axis> revolution;  ///< any turn about it is a symmetry
  double tolerance_m = 0;          ///< no visible point is carried farther off the surface

  bool trivial() const { return motions.empty() && !revolution; }
  /// Of the poses (T_sensor_model) equal to `pose` the one nearest in attitude to `reference`. Of
  /// the trivial group: `pose`, to the bit.
  Pose nearest_equal(const Pose& pose, const Pose& reference) const;
  /// Whether the motion is the identity or one of the group, within this angle, rad.
  bool contains(const Pose& motion, double angle) const;
  /// Turned about the axis of revolution, where there is one, so that it is nearest in attitude.
  Pose turned_to(const Pose& pose, const Pose& reference) const;
  /// The subgroup that leaves a point (m, model frame) and a direction through it in place, such as
  /// those of a docking interface.
  SymmetryGroup keeping(const Vector3d& point, const Vector3d& direction) const;
};

/// How well a moved surface coincides with itself, by its points that are visible from outside.
class SelfMatcher {
 public:
  /// @param surface must outlive it
  explicit SelfMatcher(const RayCaster& surface);

  double length() const { return length_; }               ///< largest side of the bounding box, m
  const Vector3d& centroid() const { return centroid_; }  ///< of the visible points
  /// About the centroid, which a symmetry leaves where it is.
  Pose turned(const Quaterniond& rotation) const;
  /// Whether a rotation within `slack` (rad) of this one may be a symmetry: whether it leaves the
  /// points' second moments unchanged within their sampling error.
  bool may_be_near_symmetry(const Quaterniond& rotation, double slack) const;
  /// Mean distance from the surface of some points, each cut off at a tenth of the length.
  double score(const Pose& motion, std::size_t points) const;
  /// The motion near this one with the least sum of squared distances (Gauss-Newton on the distance
  /// to the surface).
  Pose refined(Pose motion, std::size_t points, int iterations) const;
  /// Largest distance of a moved point from the surface, m; of the first `points`, and no more than
  /// it takes to be beyond `enough`.
  double residual(const Pose& motion, std::size_t points, double enough) const;
  std::size_t points() const { return points_.size(); }

 private:
  const RayCaster& surface_;
  double length_ = 0;
  std::vector<Vector3d> points_;
  Vector3d centroid_ = Vector3d::Zero();
  Matrix3d moments_ = Matrix3d::Zero();  ///< second, about the centroid, m^2
  double moments_sigma_ = 0;             ///< standard error of their Frobenius norm
  double moments_range_ = 0;             ///< largest less smallest principal moment
};

/// Criteria treat two poses as equal when their surfaces are nowhere farther apart than this share
/// of the target's length.
inline constexpr double symmetry_tolerance = 0.002;

/// Searches all rotations. Reproducible: the same mesh gives the same group. Independent of the
/// estimator's own list of symmetries.
SymmetryGroup find_symmetry(const RayCaster& surface);

/// The group as a file that is kept with a run, and back.
std::string yaml_of(const SymmetryGroup& group);
/// @throws InputError naming `name` and the line
SymmetryGroup read_symmetry(const std::string& yaml, const std::string& name);

}  // namespace berth
