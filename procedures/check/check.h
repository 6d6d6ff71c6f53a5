// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "procedures/check/finding.h"
#include "procedures/check/rehearsal.h"

namespace berth::procedures {

/// What can be said of a procedure before anything moves.
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

/// Of a procedure that cannot be read or set up, from what its reader said.
CheckReport report_of_error(const std::string& what, const std::string& file);

/// SI units; angles in rad.
nlohmann::json json_of(const CheckReport& report);

}  // namespace berth::procedures
