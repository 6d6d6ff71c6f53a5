// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/procedure_step_t.hpp>
#include <cstdint>
#include <optional>
#include <string>

namespace berth {

/// How a task of a batch ended, a run or a trial. `crashed`: its process died of it.
enum class Outcome { pass, fail, inconclusive, error, timeout, aborted, crashed };
/// "PASS" and so on, as in every file of results.
const char* name_of(Outcome outcome);
std::optional<Outcome> outcome_named(const std::string& name);
/// Of a procedure's run. @param outcome as in procedure_state_t
Outcome outcome_of_run(std::int8_t outcome);
/// Whether a run broke off at this step.
bool went_wrong(const procedure_step_t& step);

/// The result of a task, whichever front end requested it.
struct TaskResult {
  std::uint64_t seed = 0;
  Outcome outcome = Outcome::error;
  std::string error;  ///< what went wrong, for a person; empty when nothing did

  bool passed() const { return outcome == Outcome::pass; }
  /// A criterion was not met, or could not be judged.
  bool failed() const { return outcome == Outcome::fail || outcome == Outcome::inconclusive; }
};

}  // namespace berth
