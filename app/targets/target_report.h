// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/targets/target.h"

namespace berth {

/// A description as text: a table of parts, then a line for each joint, port and symmetry.
std::string report_of(const Target& target);

/// Probable mistakes in a description, a sentence each, with the remedy: target_notes(), parts that
/// lose most of their faces to parts before them, joints far from their part, ports inside of the
/// surface, far from it, or looking into it. Empty: none.
std::vector<std::string> validation_notes(const Target& target);

/// A target from six sides, along its axes, as SVG: parts in colours, where a joint may bring its
/// part, its axis, ports with their cones, symmetry axes, and what is to be scanned or not.
std::string draw(const Target& target);

}  // namespace berth
