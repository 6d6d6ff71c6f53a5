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

/// error: the run could not pass; warning: it may not do what was meant; note: what was assumed.
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
  std::string layout;  ///< in which it was checked
  std::string target;
  std::vector<Finding> findings;
  std::vector<StepForecast> steps;  ///< main steps, then teardown
  std::size_t main_steps = 0;
  std::size_t criteria = 0;
  double duration = 0;   ///< s, expected
  bool guessed = false;  ///< some of it

  bool good() const { return !has_errors(findings); }
};

/// Proves as much as can be of a procedure that was read: scan strategies and windows, each motion
/// in turn as the testbed will judge it, time-outs, what the LIDAR sees, what the criteria measure.
/// start: where the arms stand; the layout's home unless given.
/// @throws InputError for a layout, target or configuration that cannot be read.
CheckReport check_procedure(const Procedure& procedure, const RunSetup& setup,
                            const std::optional<testbed::ArmPair>& start = std::nullopt);

// Its parts.

/// Whether the LIDAR can see the replica wherever it is to be found or tracked.
std::vector<Finding> check_sight(const Procedure& procedure, const Rig& rig,
                                 const Rehearsal& rehearsal);

/// What a run that goes as rehearsed would record: truth with the uncertainty that the rig gives
/// it and, with_estimates, exact estimates, at the rate that the LIDAR allows.
evaluation::RunRecord forecast_record(const Rig& rig, const Rehearsal& rehearsal,
                                      bool with_estimates);

/// Whether each criterion can be judged on what the run will record, by judging a record of the
/// rehearsal: what cannot be measured there, or fails although all went as planned, is an error.
std::vector<Finding> check_criteria(const Procedure& procedure, const Rig& rig,
                                    const Rehearsal& rehearsal);

/// Of a procedure that cannot be read or set up, from the error of its reader.
CheckReport report_of_error(const std::string& what, const std::string& file);

/// SI units; angles in rad.
nlohmann::json json_of(const CheckReport& report);

}  // namespace berth::procedures
