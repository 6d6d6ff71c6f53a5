// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>

#include "app/runs/run_files.h"

namespace berth {

/// What came of estimating a log again.
struct Reestimation {
  std::int64_t recorded = 0;   ///< estimates in the old log
  std::int64_t estimates = 0;  ///< in the new one
  /// Estimates that are the recorded ones in all digits. Their seq is not looked at: a cell that
  /// was up before the log began had counted further.
  std::int64_t same = 0;
  double recorded_s = 0;   ///< from the log's first message to its last
  double wall_s = 0;       ///< of all the work
  double estimator_s = 0;  ///< of that, in the estimator

  /// Of the last scan there may be one more: the recording ended before it was out.
  bool identical() const { return same == recorded; }
};

/// Receives the share of the old log that is done, 0 to 1.
using ShareDone = std::function<void(double)>;

/// Folds the estimator of new_run over the scans and commands of a log and writes new_run's log:
/// the old log with all messages of an estimator replaced. New messages follow their input by the
/// median delay of the recorded estimates, so the new log, too, depends on nothing but the old one
/// and the configuration. RUN_INFO holds the new configuration.
/// @throws InputError when the log cannot be read or the configuration is wrong.
Reestimation reestimate_log(const std::filesystem::path& log, const RunFiles& new_run,
                            const ShareDone& share_done = {});

}  // namespace berth
