// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/batch/campaigns/manifest.h"
#include "app/batch/task_result.h"

namespace berth::campaigns {

/// Parameters with their values as text, in the manifest's order.
using Assignments = std::vector<std::pair<std::string, std::string>>;

/// One trial before it is run: a function of the manifest and its index, and of nothing else.
struct Trial {
  std::int64_t index = 0;
  std::int64_t point = 0;  ///< of the grid
  std::uint64_t seed = 0;  ///< of everything random in it; below 2^53, exact in JSON
  Assignments parameters;  ///< of the grid, then drawn
  Assignments fixed;       ///< the same in all trials
  /// Where one was drawn: of the target as the sensor sees it, model to sensor frame.
  std::optional<Quaterniond> attitude;
};

Trial trial_of(const Manifest& manifest, std::int64_t index);

/// What is kept of a trial.
struct TrialResult : TaskResult {
  std::int64_t index = 0;
  std::int64_t point = 0;
  Assignments parameters;  ///< as Trial's
  std::optional<Quaterniond> attitude;
  /// Kind of failure, a few words that many trials share: "silently wrong", "lost",
  /// "position on hold", "SIGSEGV". Empty when passed.
  std::string failure;
  /// By name, in the units of Manifest::measurements. Those that could not be measured are missing.
  std::map<std::string, double> measurements;

  /// NaN: was not measured.
  double measurement(const std::string& name) const {
    const auto found = measurements.find(name);
    return found == measurements.end() ? std::nan("") : found->second;
  }
};

/// A result with what is known of a trial beforehand.
TrialResult result_for(const Trial& trial);

}  // namespace berth::campaigns
