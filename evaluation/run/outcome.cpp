// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/outcome.h"

#include <algorithm>

#include "lcmtypes/words.h"

namespace berth::evaluation {

std::int8_t outcome_of(const std::vector<criterion_result_t>& results) {
  const auto any = [&results](std::int8_t what) {
    return std::any_of(results.begin(), results.end(),
                       [what](const criterion_result_t& r) { return r.result == what; });
  };
  if (any(criterion_result_t::FAILED)) return procedure_state_t::FAIL;
  if (any(criterion_result_t::INCONCLUSIVE)) return procedure_state_t::INCONCLUSIVE;
  return procedure_state_t::PASS;
}

std::optional<std::int8_t> outcome_named(const std::string& text) {
  for (std::int8_t o = procedure_state_t::NONE; o <= procedure_state_t::TIMEOUT; ++o) {
    if (text == words::of_outcome(o)) return o;
  }
  return std::nullopt;
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

}  // namespace berth::evaluation
