// SPDX-License-Identifier: BSD-3-Clause
#include "logs/run/outcome.h"

#include <algorithm>

namespace berth::logs {

std::int8_t outcome_of(const std::vector<criterion_result_t>& results) {
  const auto any = [&results](std::int8_t what) {
    return std::any_of(results.begin(), results.end(),
                       [what](const criterion_result_t& r) { return r.result == what; });
  };
  if (any(criterion_result_t::FAILED)) return procedure_state_t::FAIL;
  if (any(criterion_result_t::INCONCLUSIVE)) return procedure_state_t::INCONCLUSIVE;
  return procedure_state_t::PASS;
}

const char* text_of_result(std::int8_t result) {
  constexpr const char* names[] = {"PENDING", "PASS", "FAIL", "INCONCLUSIVE"};
  return result >= 0 && result <= criterion_result_t::INCONCLUSIVE ? names[result] : "PENDING";
}

const char* text_of_outcome(std::int8_t outcome) {
  constexpr const char* names[] = {"PASS", "FAIL", "ERROR", "ABORTED", "INCONCLUSIVE", "TIMEOUT"};
  return outcome >= 0 && outcome <= procedure_state_t::TIMEOUT ? names[outcome] : "NONE";
}

std::optional<std::int8_t> outcome_named(const std::string& text) {
  for (std::int8_t o = procedure_state_t::NONE; o <= procedure_state_t::TIMEOUT; ++o) {
    if (text == text_of_outcome(o)) return o;
  }
  return std::nullopt;
}

const char* text_of_step_state(std::int8_t state) {
  constexpr const char* names[] = {"PENDING", "RUNNING", "PASSED",  "FAILED",
                                   "ERROR",   "TIMEOUT", "ABORTED", "SKIPPED"};
  return state >= 0 && state <= procedure_step_t::SKIPPED ? names[state] : "?";
}

int exit_code_of_outcome(std::int8_t outcome) {
  switch (outcome) {
    case procedure_state_t::PASS:
      return 0;
    case procedure_state_t::FAIL:
      return 1;
    case procedure_state_t::ABORTED:
      return 3;
    case procedure_state_t::INCONCLUSIVE:
      return 4;
    default:
      return 2;
  }
}

std::int8_t outcome_of_exit_code(int code) {
  for (const std::int8_t outcome : {procedure_state_t::PASS, procedure_state_t::FAIL,
                                    procedure_state_t::ABORTED, procedure_state_t::INCONCLUSIVE}) {
    if (exit_code_of_outcome(outcome) == code) return outcome;
  }
  return procedure_state_t::ERROR;
}

}  // namespace berth::logs
