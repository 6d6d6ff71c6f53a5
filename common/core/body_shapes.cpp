// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/body_shapes.h"

namespace berth {
namespace {

constexpr int cylinder_sides = 16;

}  // namespace

Mesh read_shape(Config& config) {
  Pose placement;
  config.optional("pose", placement);
  if (config.has("box") == config.has("cylinder")) {
    throw config.error("box", "give either 'box' or 'cylinder'");
  }
  Mesh shape;
  if (config.has("box")) {
    const Vector3d size = config.vector("box", Dimension::length);
    if (size.minCoeff() <= 0) throw config.error("box", "sizes must be positive");
    shape = make_box(size);
  } else {
    Config cylinder = config.section("cylinder");
    const double diameter = cylinder.quantity("diameter", Dimension::length);
    const double length = cylinder.quantity("length", Dimension::length);
    cylinder.finish();
    if (diameter <= 0 || length <= 0) {
      throw cylinder.error("diameter", "diameter and length must be positive");
    }
    shape = make_cylinder(0.5 * diameter, length, cylinder_sides);
  }
  Mesh placed;
  placed.append(shape, placement);
  return placed;
}

}  // namespace berth
