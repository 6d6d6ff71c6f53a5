// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "common/targets/target.h"
#include "evaluation/measure/measurer.h"

namespace berth::evaluation {

/// The target that RUN_INFO names, for load_target(): the run's own copy, or, where that is not
/// there, the shipped one of that name.
std::string target_name_of_run(const run_info_t& info, const std::filesystem::path& directory);

/// The target that RUN_INFO names; a relative name counts from the directory of the run's log.
/// @throws InputError when it cannot be loaded.
Target target_of_run(const run_info_t& info, const std::filesystem::path& directory);

/// Name of RUN_INFO's attachment, and of the file next to the log, that holds the target's
/// symmetry.
inline constexpr char symmetry_file[] = "symmetry.yaml";

/// The symmetry by which a run is judged, as RUN_INFO holds it. The trivial one where it holds
/// none, as in runs of before it was kept, or, with the reason in `why`, one that cannot be read.
SymmetryGroup symmetry_of_run(const run_info_t& info, std::string* why = nullptr);

/// Nearest point on a target.
NearestPoint nearest_point_on(const Target& target);

/// Nearest point on the target of a recorded run; empty, with the reason in `why`, when the mesh
/// that RUN_INFO names cannot be loaded any more or is not the same one.
NearestPoint nearest_point_of_run(const run_info_t& info, const std::filesystem::path& directory,
                                  std::string& why);

}  // namespace berth::evaluation
