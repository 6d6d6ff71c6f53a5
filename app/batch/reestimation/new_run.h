// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/runs/run_files.h"

namespace berth {

/// The changes against the recorded run.
struct EstimatorChanges {
  /// An estimator.yaml, or a configuration directory whose estimator.yaml and lidars/ are taken;
  /// empty: as recorded.
  std::filesystem::path config;
  std::vector<std::string> set;  ///< "tracking.method=icp": keys of estimator.yaml

  bool none() const { return config.empty() && set.empty(); }
};

/// Makes `directory`, a run directory like the recorded one in all but the log, with the changes
/// made in its configuration. Keys that an earlier version wrote into its estimator.yaml are read
/// as their replacements; those of a file of `changes` are not. Of a log without its directory:
/// from the files in RUN_INFO.
/// @throws InputError for wrong or missing input.
RunFiles make_new_run(const std::filesystem::path& run_or_log, const EstimatorChanges& changes,
                      const std::filesystem::path& directory);

}  // namespace berth
