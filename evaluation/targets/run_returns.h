// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/targets/target_measurement.h"

namespace berth::targets {

/// The returns of a run about the target, at times of which it has truth; at most some 200,000,
/// evenly, of beams that met one surface only. target_hash: of the mesh that RUN_INFO names; empty
/// without one.
struct RunReturns {
  std::vector<TrueReturn> returns;
  std::string target_hash;
};

/// @param reach m, from the model's origin: what is farther is not of the target
/// @throws InputError when the log cannot be read.
RunReturns read_returns(const std::filesystem::path& log, double reach);

}  // namespace berth::targets
