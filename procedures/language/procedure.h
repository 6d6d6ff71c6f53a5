// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "evaluation/measure/figure.h"
#include "procedures/language/limit.h"
#include "procedures/language/parameters.h"
#include "procedures/language/steps.h"

namespace berth::procedures {

/// A test script as it will run: repeats, sweeps and calls are unrolled.
struct Procedure {
  std::string file;
  std::string text;  ///< as run: parameters filled in, called procedures attached; self-contained
  std::string name;
  std::string description;
  std::string layout;   ///< empty: the operator's choice
  int layout_line = 0;  ///< of the file
  std::string target;   ///< empty: the operator's choice
  int target_line = 0;
  double target_length = 0;  ///< m; 0: as it is
  std::string world;         ///< of the simulated cell; empty: the operator's choice
  int world_line = 0;
  /// s without a good estimate, while tracking, after which the run has failed
  double lost_for = 15;
  std::vector<Step> steps;
  std::vector<Step> teardown;  ///< always run
  std::vector<Limit> limits;
  std::vector<evaluation::Criterion> criteria;
  std::string source;  ///< reference of its claims and figures
  std::vector<evaluation::Figure> figures;
};

/// Maximum number of unrolled steps, teardown included, that fit into PROCEDURE_STATE.
inline constexpr int max_steps = 400;

/// Reads and checks a procedure: syntax, names, units, phases, parameters, called procedures.
/// @throws InputError "file:line: key ...: found ..., expected ...".
Procedure load_procedure(const std::filesystem::path& file, const Overrides& overrides = {});

/// The procedures below a directory, in order of their names. Other YAML files, such as plans of
/// nights, have no `steps` and are left out. A file that cannot be read is included, so that it is
/// reported.
std::vector<std::filesystem::path> procedures_in(const std::filesystem::path& directory);
/// Called procedures are searched next to `file`.
Procedure parse_procedure(const std::string& text, const std::string& file,
                          const Overrides& overrides = {});

/// The keys of a procedure.
const std::vector<KeyInfo>& procedure_keys();
/// @throws InputError for missing or unknown keys.
void check_top_level(Config& config);

}  // namespace berth::procedures
