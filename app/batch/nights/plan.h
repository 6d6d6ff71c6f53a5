// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "app/batch/result_store.h"
#include "evaluation/compare/change.h"

namespace berth::nights {

/// A procedure under one set of conditions: what is compared from night to night.
struct Case {
  std::string name;  ///< unique in a plan: the procedure's, with the conditions that distinguish it
  std::filesystem::path procedure;
  std::string target;            ///< empty: the procedure's own
  std::string host = "twin";     ///< "twin", "simulated-cell" or "cell"
  std::string world;             ///< of config/worlds; empty: the procedure's own, or the default
  std::filesystem::path config;  ///< empty: the one shipped with the build
  std::filesystem::path estimator;  ///< as `berth run --estimator`; empty: the build's own
  std::map<std::string, std::string> parameters;
  std::vector<std::uint64_t> fixed;  ///< seeds of every night
  int fresh = 0;                     ///< how many seeds are drawn anew each night
  double may_fail = 0;               ///< share of the runs that fail when all is well

  /// Whether measurements are compared with those of before. In worlds that depart from the files a
  /// run depends more on what was drawn than on the build: there only the share of failures is
  /// judged, and the comparisons in `exact` stay as sharp as without such worlds.
  bool is_compared() const { return world.empty() || world == "exact"; }
};

/// References of the comparison in addition to the history.
struct Baseline {
  std::filesystem::path build;   ///< its program or launcher `berth`; empty: none
  std::filesystem::path config;  ///< empty: the one shipped with that build
};

/// Recorded runs that tonight's estimator goes over again.
struct Archive {
  std::filesystem::path runs;    ///< a directory of run directories; empty: none
  std::filesystem::path config;  ///< as `berth reestimate --config`; empty: as recorded
};

/// A nightly plan.
struct Plan {
  std::filesystem::path file;
  std::string name;
  std::string text;
  std::vector<Case> cases;
  Baseline baseline;
  Archive archive;
  int jobs = 0;                      ///< runs at a time; 0: one per core
  double time_budget_s = 0;          ///< no run is begun later; 0: no limit
  double run_timeout_s = 600;        ///< of one run
  std::string notify;                ///< shell command; empty: none
  int keep = 20;                     ///< directories of passed runs
  int history_nights = 30;           ///< that fresh seeds are compared with
  double family_wise_alpha = 0.002;  ///< probability of any false alarm in a night
  evaluation::MinimumEffect minimum_effect;
};

/// Reads and checks a plan. Paths in it are relative to its own directory.
///
///     name: nightly
///     jobs: 2
///     time_budget: 2 h
///     baseline: {build: /opt/berth-good/bin/berth}
///     archive: {runs: ../archive, config: ../config}
///     seeds: {fixed: 12, fresh: 6}        # default of every procedure
///     procedures:
///       - procedure: ../procedures/approach.yaml
///         seeds: {fixed: [1, 2, 7], fresh: 4}
///         targets: [radarsat2, envisat.stl]
///         hosts: [twin]
///         worlds: [exact, lab]
///         configs: [../config]
///         set: {speed: 30 mm/s}
///         may_fail: 5 %
///         estimator: ../mine.so
///
/// @throws InputError "file:line: key ...: found ..., expected ..."
Plan load_plan(const std::filesystem::path& file);

/// Criteria of a case's procedure, with the parameters that the plan sets.
/// @throws InputError when the procedure cannot be read (any more).
std::vector<evaluation::Criterion> criteria_of(const Case& of);

/// What is kept of one.
using Night = BatchRecord;

/// One run of a night, before it happened.
struct PlannedRun {
  const Case* of = nullptr;
  Build build = Build::tonight;
  std::uint64_t seed = 0;
  bool fresh = false;

  /// Once in a night, good as a file name: "approach-seed3", "approach-seed3-baseline".
  std::string name() const;
};

/// Everything a night runs, in turns: the first seed of all cases, then the second, so that a night
/// that is cut short has some of everything. Fresh seeds follow from the plan's name and the
/// night's number. The baseline runs what is paired: fixed seeds in the twin.
std::vector<PlannedRun> runs_of_night(const Plan& plan, std::int64_t night_number);

}  // namespace berth::nights
