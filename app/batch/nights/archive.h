// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/nights/plan.h"

namespace berth::nights {

/// A recorded run, estimated again.
struct ArchivedRun {
  std::string name;   ///< its directory's
  std::string error;  ///< why it could not be estimated again; empty: it was
  std::int64_t estimates = 0;
  std::int64_t same = 0;  ///< of them, as recorded, number for number
  std::string verdict;    ///< against truth: "better", "worse", "mixed" or "no difference"
};

/// What tonight's estimator makes of recorded scans.
struct ArchiveResult {
  std::vector<ArchivedRun> runs;
  /// Errors of all runs together against truth, where they differ significantly from the recorded.
  std::vector<FlaggedChange> changes;

  bool failed() const;  ///< some run could not be estimated again
};

/// Estimates every run of the plan's archive again, in a process of its own, and keeps its output
/// in archive.json; the new run directories are not kept. Unreadable output is an error of that run
/// alone. Nothing without an archive.
/// @param night its directory
ArchiveResult estimate_archive(const Plan& plan, const std::filesystem::path& program,
                               const std::filesystem::path& night);

}  // namespace berth::nights
