// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/targets/target.h"

namespace berth {

/// A target from six sides, along its axes, as SVG: parts in colours, where a joint may bring its
/// part, its axis, ports with their cones, symmetry axes, and what is to be scanned or not.
std::string draw(const Target& target);

}  // namespace berth
