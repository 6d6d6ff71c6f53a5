// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/batch/nights/database.h"
#include "app/batch/nights/plan.h"
#include "app/batch/task_result.h"

namespace berth::nights {

/// One number of one run, in the measurement's shown unit.
struct RunValue {
  std::string phase;
  std::string measurement;
  std::string statistic;
  std::string unit;
  double value = 0;
  std::int64_t samples = 0;
};

/// What became of one run. One that crashed is an error.
struct FinishedRun : TaskResult {
  std::string case_name;
  Build build = Build::tonight;
  bool fresh = false;
  std::string procedure;       ///< its file
  std::string procedure_hash;  ///< over the file and the parameters set
  std::string target;
  std::string host;
  std::string version;  ///< of the build that ran it
  std::string configuration_hash;
  std::string directory;  ///< relative to the night's; empty once it is deleted
  double simulated_s = 0;
  double wall_s = 0;
  double cpu_s = 0;
  std::vector<RunValue> values;
};

/// One night and its verdict.
struct Night {
  std::int64_t id = 0;
  std::int64_t number = 0;  ///< of this plan, from 1
  std::string name;         ///< its directory, e.g. "2026-11-21"
  std::string begun;        ///< UTC
  std::string ended;        ///< UTC; empty while it is open
  std::string plan_hash;
  std::string build;     ///< version and the program's hash
  std::string baseline;  ///< the same of the baseline; empty without one
  std::string version;
  std::string configuration_hash;
  std::string verdict;    ///< "clean", "regression", "failed", "error", "interrupted"; or empty
  bool accepted = false;  ///< a person took its changes for good: what follows compares with it
  double wall_s = 0;

  /// Others may be compared with it.
  bool good() const { return verdict == "clean" || accepted; }
};

/// The values of one quantity in one run.
struct TrendValue {
  std::int64_t night = 0;  ///< its number
  Build build = Build::tonight;
  double value = 0;
};

/// A change that was flagged, as kept.
struct FlaggedChange {
  std::string against;  ///< "baseline", "last night", "history"; of an archive "recorded"
  std::string case_name;
  std::string phase;
  std::string measurement;
  std::string statistic;
  std::string unit;
  double before = 0;
  double after = 0;
  double low = 0;  ///< 95 % interval of after - before
  double high = 0;
  double p = 1;      ///< family-wise p-value
  std::string kind;  ///< "worse", "better" or "changed"
  std::size_t runs = 0;
};

/// The SQLite file of all nights of one plan: every number of every run, for good.
class History {
 public:
  /// @throws InputError when the file is not a history, or one of a newer Berth.
  explicit History(const std::filesystem::path& file);

  /// All nights, oldest first.
  std::vector<Night> nights();
  std::optional<Night> night_named(const std::string& name);
  /// Begins a night; fills in id and number.
  void begin(Night& night);
  void finish(const Night& night, const std::vector<FlaggedChange>& changes);
  void accept(const std::string& night);

  /// In one transaction: a run is there with all its values, or not at all; and how long the night
  /// has lasted, should it be interrupted.
  void record(const Night& night, const FinishedRun& run);
  void forget_directory(const Night& night, const std::string& directory);
  /// In the order they were recorded.
  enum class Which { all_without_values, all, fixed, fresh };
  std::vector<FinishedRun> runs(const Night& night, Which which = Which::all);
  /// Of finished nights from this number on, oldest first.
  std::vector<TrendValue> trend(std::int64_t first_night, const std::string& case_name,
                                const std::string& phase, const std::string& measurement,
                                const std::string& statistic);
  std::vector<FlaggedChange> changes(const Night& night);

 private:
  std::int64_t quantity(const RunValue& value);

  Database database_;
};

}  // namespace berth::nights
