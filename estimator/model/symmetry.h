// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/model/visible_surface.h"

namespace berth::estimator {

/// A motion that carries the target's visible surface onto itself, or nearly so.
struct Symmetry {
  Pose motion;             ///< model frame to model frame
  double deviation_m = 0;  ///< rms distance of the moved surface from the surface
  bool exact = false;      ///< nobody can tell the two poses apart
};

/// The target's own symmetries, measured. Two poses that an exact one carries into each other are
/// one and the same pose; a near one names the poses that are easily confused.
struct Symmetries {
  /// Without the identity: first the exact ones, then near ones by growing deviation; of near ones
  /// that exact ones carry into each other only one.
  std::vector<Symmetry> motions;
  bool revolution = false;            ///< any turn about the axis is exact; motions are modulo that
  Vector3d axis = Vector3d::UnitZ();  ///< unit, model frame; of a surface of revolution
  Vector3d centre = Vector3d::Zero();  ///< of the visible surface, which all motions leave in place

  /// How many poses are equal, the given one included; of a surface of revolution without turns.
  int exact_count() const;
  /// Of the poses (T_sensor_model) equal to `pose` the one turned least from `reference`.
  Pose nearest_equal(const Pose& pose, const Pose& reference) const;
  /// Whether the motion is the identity or one of `motions`, within slack (rad); equal: or turns
  /// into one of them by an exact symmetry.
  bool leads_to(const Pose& motion, double slack, bool equal) const;
  /// Angle (rad) and distance (m, of the centre) from `reference` to the nearest pose equal to
  /// `pose`.
  double angle_between(const Pose& pose, const Pose& reference) const;
  double distance(const Pose& pose, const Pose& reference) const;
};

/// Measures symmetries: every rotation about the surface's centroid is tried on a grid, what fits
/// is laid on exactly, then the deviation is measured. mesh: the target's. length: of the target,
/// m.
Symmetries measure_symmetries(const Mesh& mesh, const VisibleSurface& surface,
                              const ClosestPointGrid& grid, double length);

}  // namespace berth::estimator
