// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/config.h"
#include "common/core/mesh.h"

namespace berth {

/// Reads the simple convex shape of a map: `box: [x, y, z]` or `cylinder: {diameter, length}` (axis
/// along z), placed by an optional `pose: [x, y, z, w, p, r]`. @throws InputError.
Mesh read_shape(Config& config);

}  // namespace berth
