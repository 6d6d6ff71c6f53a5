// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/mesh.h"

namespace berth::testbed {

/// Boxes that together cover a mesh: it is sliced across its longest side, each slice is boxed.
/// Slices with nothing in them are left out.
std::vector<Box> cover_with_boxes(const Mesh& mesh, int slices);

}  // namespace berth::testbed
