// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "app/runs/run_files.h"
#include "common/bus/node.h"
#include "common/core/run_setup.h"

namespace berth {

/// Value instead of a path: the estimator is started outside the run.
inline constexpr char outside_estimator[] = "outside";

/// What `--estimator` names: outside_estimator, or a file as an absolute path.
/// @param host "twin" needs a shared library (estimator/node/estimator_plugin.h), which is tried;
///             others a program or `outside`
/// @throws InputError for what cannot be used there.
std::string check_own_estimator(const std::string& named, const std::string& host);

using EstimatorMaker =
    std::function<std::unique_ptr<Node>(NodeSetup, const RunSetup&, Bus&, Loop&)>;

/// Loads the shared library, for as long as this process lives.
/// @throws InputError when it is none, or of another version of Berth.
EstimatorMaker load_own_estimator(const std::filesystem::path& library);

/// The record of it in RUN_INFO: its file's name and SHA-256, or `outside` and nothing.
struct OwnEstimatorRecord {
  std::string name;
  std::string sha256;
};
OwnEstimatorRecord record_of_own_estimator(const std::string& named);

/// Instructions for starting an outside estimator of this run.
std::string how_to_start_estimator(const RunFiles& files);

}  // namespace berth
