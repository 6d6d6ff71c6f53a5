// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>
#include <vector>

#include "app/campaigns/sphere_grid.h"
#include "logs/report/colour_scale.h"

namespace berth::campaigns {

/// A point of Hammer's projection (1892) of the whole sphere, which keeps areas: x to the east from
/// -2 sqrt(2) to 2 sqrt(2), y to the north from -sqrt(2) to sqrt(2).
std::array<double, 2> hammer(double longitude, double latitude);

/// A value on each cell of the sphere of directions.
struct SphereMap {
  std::string title;
  std::vector<double> values;       ///< by cell; NaN: nothing known
  std::vector<std::string> hovers;  ///< by cell
};

/// The map of the model frame's directions, as of a globe seen from outside: +z above, +x in the
/// middle, +y to the right of it.
report::Html html_of(const SphereMap& map, const SphereGrid& grid,
                     const report::ColourScale& scale);

/// From where in the model frame a target of this attitude (model to sensor frame) is seen: unit,
/// towards the sensor. For a target ahead of the sensor, whose boresight is z.
Vector3d viewing_direction(const Quaterniond& q_sensor_model);
/// How the model's z axis, as the sensor sees it, is turned to the right from upwards, rad; 0 where
/// it points at the sensor or away.
double viewing_roll(const Quaterniond& q_sensor_model);

/// "lon 90 deg, lat -30 deg", and of a direction near an axis its name.
std::string name_of_direction(const Vector3d& direction);

}  // namespace berth::campaigns
