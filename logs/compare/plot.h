// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "logs/measure/measurement.h"

namespace berth::logs {

/// Draws estimate against truth (x y z w p r, as the paper's Figure 10) and the errors over time
/// into an SVG, with gnuplot. @return false when gnuplot is not there or fails: a picture is a
/// comfort, not a result.
bool write_plot(const RunRecord& record, const std::filesystem::path& svg);

}  // namespace berth::logs
