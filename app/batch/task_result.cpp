// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/task_result.h"

#include <array>

#include "lcmtypes/words.h"

namespace berth {
namespace {

constexpr std::array<std::pair<Outcome, const char*>, 7> outcome_names = {
    {{Outcome::pass, "PASS"},
     {Outcome::fail, "FAIL"},
     {Outcome::inconclusive, "INCONCLUSIVE"},
     {Outcome::error, "ERROR"},
     {Outcome::timeout, "TIMEOUT"},
     {Outcome::aborted, "ABORTED"},
     {Outcome::crashed, "CRASHED"}}};

}  // namespace

const char* name_of(Outcome outcome) {
  for (const auto& [value, name] : outcome_names) {
    if (value == outcome) return name;
  }
  return "?";
}

std::optional<Outcome> outcome_named(const std::string& name) {
  for (const auto& [value, known] : outcome_names) {
    if (name == known) return value;
  }
  return std::nullopt;
}

Outcome outcome_of_run(std::int8_t outcome) {
  return outcome_named(words::of_outcome(outcome)).value_or(Outcome::error);
}

bool went_wrong(const procedure_step_t& step) {
  return step.state == procedure_step_t::FAILED || step.state == procedure_step_t::ERROR ||
         step.state == procedure_step_t::TIMEOUT || step.state == procedure_step_t::ABORTED;
}

}  // namespace berth
