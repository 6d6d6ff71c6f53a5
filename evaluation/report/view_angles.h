// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/ray_caster.h"
#include "common/core/svg.h"

namespace berth::report {

/// A rectangle in azimuth (to the right) and elevation (up), rad.
struct AngleBox {
  double left = 1e9;
  double right = -1e9;
  double bottom = 1e9;
  double top = -1e9;

  void add(double azimuth, double elevation);
  void add(const AngleBox& other);
  /// By a part of its larger side, all around.
  void widen(double part);
  bool empty() const { return left > right; }
};

/// The angles of a box of the model frame as seen by the sensor; empty when a corner is behind it.
AngleBox angles_of(const Box& box, const Pose& T_sensor_model);

/// Azimuth and elevation on paper.
struct View {
  AngleBox box;
  double scale = 1;  ///< units of the picture per rad
  double width = 0;
  double height = 0;

  double x(double azimuth) const { return scale * (azimuth - box.left); }
  double y(double elevation) const { return scale * (box.top - elevation); }
};
View view_of(const AngleBox& box);

/// The target as the sensor sees it: rays cast on a grid, in a few shades, the darker
/// the more a surface is turned away.
svg::Markup shaded(const RayCaster& target, const Pose& T_sensor_model, const View& view);

}  // namespace berth::report
