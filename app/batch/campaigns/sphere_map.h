// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "common/core/pose.h"
#include "evaluation/report/heat_map.h"

namespace berth::campaigns {

/// The sphere cut into cells of exactly equal area, nearly square but at the poles: rings of equal
/// cells, their number in proportion to the ring's length (after Malkin, "A new method to subdivide
/// a spherical surface into equal-area cells", 2016).
class SphereGrid {
 public:
  /// @param cells number of cells, at least 1; as near as the rings allow
  explicit SphereGrid(std::size_t cells);

  /// Longitude from -pi to pi about z, from x; latitude, rad.
  struct Cell {
    double west;
    double east;
    double south;
    double north;
  };

  std::size_t size() const { return cells_.size(); }
  const Cell& cell(std::size_t index) const { return cells_[index]; }
  /// Of a direction of any length but zero.
  std::size_t cell_at(const Vector3d& direction) const;

 private:
  struct Ring {
    double south_z;  ///< sine of its southern latitude
    std::size_t first;
    std::size_t count;
  };
  std::vector<Ring> rings_;  ///< from north to south
  std::vector<Cell> cells_;
};

/// A point of Hammer's projection (1892) of the whole sphere, which keeps areas: x to the east from
/// -2 sqrt(2) to 2 sqrt(2), y to the north from -sqrt(2) to sqrt(2).
std::array<double, 2> hammer(double longitude, double latitude);

/// A value on each cell of the sphere of directions.
struct SphereMap {
  std::string title;
  std::vector<double> values;       ///< by cell; NaN: nothing known
  std::vector<std::string> hovers;  ///< by cell
};

/// The map as of a globe seen from outside, with the face that looks at the sensor at the identity
/// pose in the middle, as the sensor sees it: -z in the middle, +x to the right, -y above.
report::Html picture_of(const SphereMap& map, const SphereGrid& grid,
                        const report::ColourScale& scale);

/// From where a target of this attitude (model to sensor frame) is seen, as a direction of the map:
/// unit; x to the middle of the map (-z of the model), y to its right (+x), z upwards (-y). For a
/// target ahead of the sensor, whose boresight is z.
Vector3d viewing_direction(const Quaterniond& q_sensor_model);
/// The same in the model frame.
Vector3d direction_in_model(const Vector3d& on_map);
/// An attitude in which a target is seen from that direction of the map, upright.
Quaterniond upright_attitude(const Vector3d& on_map);
/// How what is above on the map is turned to the right in the sensor's picture, rad.
double viewing_roll(const Quaterniond& q_sensor_model);

/// "20° right, 30° up" from the middle of the map.
std::string name_of_direction(const Vector3d& on_map);

}  // namespace berth::campaigns
