// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "procedures/check/rehearsal.h"

namespace berth::evaluation {
class RunRecord;
}

namespace berth::procedures {

/// error: the run could not pass; warning: it may not do what was intended; note: an assumption.
enum class Severity { error, warning, note };
const char* name_of(Severity severity);

/// One result of a check of a procedure.
struct Finding {
  Severity severity = Severity::error;
  std::string file;
  int line = 0;     ///< 0: of the whole file
  std::string key;  ///< step, criterion or key of the file
  std::string found;
  std::string expected;  ///< may be empty
  int step = -1;         ///< index among main steps, then teardown; -1: of none
};

/// "file:line: error: step 'move': found ..., expected ...".
std::string text_of(const Finding& finding);

/// Of an InputError's "file:line: key ...".
Finding finding_of_error(const std::string& what, const std::string& file);

bool has_errors(const std::vector<Finding>& findings);

/// Results of the check of a procedure before anything moves.
struct CheckReport {
  std::string file;
  std::string name;    ///< of the procedure; empty when it cannot be read
  std::string layout;  ///< of the check
  std::string target;
  std::vector<Finding> findings;
  std::vector<StepForecast> steps;  ///< main steps, then teardown
  std::size_t main_steps = 0;
  std::size_t criteria = 0;
  double duration = 0;   ///< s, expected
  bool guessed = false;  ///< partly

  bool good() const { return !has_errors(findings); }
};

/// Checks a procedure before a run: scan strategies and windows, each motion in turn by the
/// testbed's own check, time-outs, visibility to the LIDAR, measurability of the criteria. start:
/// joints of the arms; default: the layout's home.
/// @throws InputError for a layout, target or configuration that cannot be read.
CheckReport check_procedure(const Procedure& procedure, const RunSetup& setup,
                            const std::optional<testbed::ArmPair>& start = std::nullopt);

// Its parts.

/// Whether the LIDAR can see the replica wherever it is to be found or tracked.
std::vector<Finding> check_visibility(const Procedure& procedure, const Rig& rig,
                                      const Rehearsal& rehearsal);

/// The record of a run that goes as rehearsed: truth with the rig's covariance and, with_estimates,
/// exact estimates at the LIDAR's rate.
evaluation::RunRecord forecast_record(const Rig& rig, const Rehearsal& rehearsal,
                                      bool with_estimates);

/// Judges the criteria on a record of the rehearsal: one that cannot be measured there, or fails
/// although all went as planned, is an error.
std::vector<Finding> check_criteria(const Procedure& procedure, const Rig& rig,
                                    const Rehearsal& rehearsal);

/// Of a procedure that cannot be read or set up, from the error of its reader.
CheckReport report_of_error(const std::string& what, const std::string& file);

/// SI units; angles in rad.
nlohmann::json json_of(const CheckReport& report);

}  // namespace berth::procedures
