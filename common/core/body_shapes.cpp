// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/body_shapes.h"

namespace berth {
namespace {

constexpr int cylinder_sides = 16;

}  // namespace

Mesh read_shape(Config& config) {
  Pose placement;
  config.optional("pose", placement);
  std::optional<Vector3d> box;
  config.optional("box", Dimension::length, box, above(0));
  Config cylinder = config.optional_section("cylinder");
  if (box.has_value() == config.has("cylinder")) {
    throw config.error("box", "give either 'box' or 'cylinder'");
  }
  Mesh shape;
  if (box) {
    shape = make_box(*box);
  } else {
    const double diameter = cylinder.quantity("diameter", Dimension::length, above(0));
    const double length = cylinder.quantity("length", Dimension::length, above(0));
    cylinder.finish();
    shape = make_cylinder(0.5 * diameter, length, cylinder_sides);
  }
  Mesh placed;
  placed.append(shape, placement);
  return placed;
}

}  // namespace berth
