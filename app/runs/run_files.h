// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "common/core/run_setup.h"
#include "common/core/shared_files.h"

namespace berth {

/// A user's request for a run that has no directory yet.
struct RunRequest {
  std::filesystem::path procedure;  ///< empty: only bring the cell up
  std::string layout;               ///< empty: the procedure's own
  std::string target;               ///< empty: the procedure's own
  double target_length = 0;         ///< m; 0: the procedure's own
  std::string world;                ///< empty: the procedure's own, or simulation.yaml's
  std::map<std::string, std::string> parameters;  ///< --set NAME=VALUE
  std::uint64_t seed = 1;
  std::string host = "simulated-cell";  ///< "simulated-cell", "cell" or "twin"
  std::string url;                      ///< LCM URL; empty in the twin
  std::filesystem::path joins;          ///< run directory of a cell that is up already
  std::filesystem::path config;         ///< configuration to copy; empty: the one shipped
  std::filesystem::path calibration;    ///< file that this cell has; empty: the configuration's own
  std::string estimator;                ///< as of check_own_estimator(); empty: Berth's
  std::filesystem::path out = "runs";   ///< the run directory is made under it
  std::string operator_name;            ///< empty: default_operator()
};

/// A run directory: everything that makes and records one run.
///
///     run.yaml            what the run is (read by every node program)
///     procedure.yaml      the procedure as run
///     config/             the configuration as used
///     target/             the target: NAME/target.yaml with its mesh, or a mesh alone
///     symmetry.yaml       by which poses of the target are one
///     types/              the message definitions
///     manifest.json       who, where, when, with what; hashes of all of the above
///     run.lcm             the log
///     world_truth.lcm     of a simulated cell: where everything really was, for tests and reports
///     output/             what the processes printed
/// and after the end:
///     verdict.txt, results.json, results.xml (JUnit), events.jsonl, report.html
///     SHA256SUMS          of everything, last
struct RunFiles {
  std::filesystem::path directory;
  std::string name;  ///< of the run; in the twin it holds no wall time
  std::string host;
  std::string url;
  std::map<std::string, std::string> parameters;
  bool has_procedure = false;
  bool joins = false;     ///< the cell was up already: only recorder and procedure are ours
  std::string estimator;  ///< as of check_own_estimator(); empty: Berth's
  std::string configuration_hash;  ///< over config/, layout and target
  RunSetup setup;                  ///< paths inside the directory

  /// Makes the directory. @throws InputError for what a user got wrong.
  static RunFiles create(const RunRequest& request);
  /// Reads one. @throws InputError when it is none.
  static RunFiles open(const std::filesystem::path& directory);

  std::filesystem::path procedure() const { return directory / "procedure.yaml"; }
  std::filesystem::path log() const { return directory / "run.lcm"; }
};

}  // namespace berth
