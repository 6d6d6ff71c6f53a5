// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/batch/database.h"
#include "app/batch/task_result.h"

namespace berth {

/// Which of two builds, or configurations, a run is of: the one that is judged, or the one that it
/// is compared with (of a re-estimation: the run as recorded).
enum class Build { tonight, baseline };
/// "tonight", "baseline".
const char* name_of(Build build);

/// One number of one run, in the measurement's shown unit.
struct RunValue {
  std::string phase;
  std::string measurement;
  std::string statistic;
  std::string unit;
  double value = 0;
  std::int64_t samples = 0;
};

/// What became of one run, or one trial of a campaign.
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
  std::string directory;  ///< relative to the batch's; empty once it is deleted
  double simulated_s = 0;
  double wall_s = 0;
  double cpu_s = 0;
  std::vector<RunValue> values;
  /// What only its front end knows of it, as text: "parameters.returns": "35".
  std::map<std::string, std::string> details;
};

/// A night, a campaign or a re-estimation: what is common to its runs, and its verdict.
struct BatchRecord {
  std::int64_t id = 0;
  std::int64_t number = 0;  ///< in its file, from 1
  std::string name;         ///< of a night its directory, e.g. "2026-11-21"
  std::string begun;        ///< UTC
  std::string ended;        ///< UTC; empty while it is open
  std::string plan_hash;
  std::string build;     ///< version and the program's hash
  std::string baseline;  ///< the same of the baseline; empty without one
  std::string version;
  std::string configuration_hash;
  /// Of a night "clean", "regression", "failed", "error", "interrupted"; of a re-estimation that
  /// of its comparison; or empty.
  std::string verdict;
  bool accepted = false;  ///< a person took its changes for good: what follows compares with it
  double wall_s = 0;

  /// Others may be compared with it.
  bool good() const { return verdict == "clean" || accepted; }
};

/// The values of one quantity in one run.
struct TrendValue {
  std::int64_t batch = 0;  ///< its number
  Build build = Build::tonight;
  double value = 0;
};

/// A change that was flagged, as kept.
struct FlaggedChange {
  std::string against;  ///< "baseline", "last night", "history"; of a re-estimation "recorded"
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

/// Results of batches in an SQLite file: every number of every run, for good. The file of nights,
/// of campaigns and of re-estimations; people read its view `result` with sqlite3:
///
///     SELECT night, "case", measurement, avg(value), unit FROM result GROUP BY 1, 2, 3
///
/// A batch is a row of its table `night`. Not for several threads; several processes wait for each
/// other. All functions throw std::runtime_error when the file cannot be read or written.
class ResultStore {
 public:
  /// Opens or makes it.
  /// @throws InputError when the file is no such store, or one of a newer Berth.
  explicit ResultStore(const std::filesystem::path& file);

  /// All of them, oldest first.
  std::vector<BatchRecord> batches();
  std::optional<BatchRecord> batch_named(const std::string& name);
  /// The name, or the first of name-2, name-3, ... that no batch has.
  std::string free_name(const std::string& name);
  /// Begins a batch; fills in id and number.
  void begin(BatchRecord& batch);
  void finish(const BatchRecord& batch, const std::vector<FlaggedChange>& changes);
  void accept(const std::string& batch);

  /// In one transaction: the runs are there with all their values, or not at all; and how long the
  /// batch has lasted, should it be interrupted.
  void record(const BatchRecord& batch, const std::vector<FinishedRun>& runs);
  void forget_directory(const BatchRecord& batch, const std::string& directory);
  /// In the order they were recorded.
  enum class Which { all_without_values, all, fixed, fresh };
  void for_each_run(const BatchRecord& batch, Which which,
                    const std::function<void(FinishedRun)>& each);
  std::vector<FinishedRun> runs(const BatchRecord& batch, Which which = Which::all);
  /// Of finished batches from this number on, oldest first.
  std::vector<TrendValue> trend(std::int64_t first_batch, const std::string& case_name,
                                const std::string& phase, const std::string& measurement,
                                const std::string& statistic);
  std::vector<FlaggedChange> changes(const BatchRecord& batch);

 private:
  Database database_;
};

}  // namespace berth
