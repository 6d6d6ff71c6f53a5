// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/model/closest_point_grid.h"
#include "estimator/model/visible_surface.h"

namespace berth::estimator {

/// A motion that maps the target's visible surface onto itself, exactly or nearly.
struct Symmetry {
  Pose motion;             ///< model frame to model frame
  double deviation_m = 0;  ///< rms distance of the moved surface from the surface
  bool exact = false;      ///< the two poses are indistinguishable
};

/// The target's symmetries, measured. Two poses related by an exact symmetry are the same pose; a
/// near symmetry relates poses that are easily confused.
struct Symmetries {
  /// Without the identity: first the exact ones, then near ones by growing deviation, one of each
  /// class under the exact ones.
  std::vector<Symmetry> motions;
  bool revolution = false;  ///< any turn about the axis is exact; motions are modulo such turns
  Vector3d axis = Vector3d::UnitZ();   ///< unit, model frame; of a surface of revolution
  Vector3d centre = Vector3d::Zero();  ///< of the visible surface, fixed by all motions

  /// Number of equal poses, the identity included; for a surface of revolution without turns.
  int exact_count() const;
  /// The pose (T_sensor_model) equal to `pose` with the smallest rotation from `reference`.
  Pose nearest_equal(const Pose& pose, const Pose& reference) const;
  /// Whether the motion is the identity or one of `motions`, within slack (rad); equal: or becomes
  /// one of them by an exact symmetry.
  bool contains(const Pose& motion, double slack, bool equal) const;
  /// Angle (rad) and distance (m, of the centre) from `reference` to the nearest pose equal to
  /// `pose`.
  double angle_between(const Pose& pose, const Pose& reference) const;
  double distance(const Pose& pose, const Pose& reference) const;
};

/// Measures symmetries: a grid of rotations about the surface's centroid is scored, the best are
/// aligned, then the deviation is measured. mesh: the target's. length: of the target, m.
Symmetries measure_symmetries(const Mesh& mesh, const VisibleSurface& surface,
                              const ClosestPointGrid& grid, double length);

}  // namespace berth::estimator
