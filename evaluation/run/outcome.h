// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/criterion_result_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <optional>
#include <string>
#include <vector>

namespace berth::evaluation {

/// procedure_state_t::FAIL if any failed, else INCONCLUSIVE if any is, else PASS.
std::int8_t outcome_of(const std::vector<criterion_result_t>& results);

/// Inverse of words::of_outcome; nothing for any other text.
std::optional<std::int8_t> outcome_named(const std::string& text);
/// The exit code of a program that ran or judged a procedure: 0 pass, 1 fail, 2 error or time-out,
/// 3 aborted, 4 inconclusive.
int exit_code_of_outcome(std::int8_t outcome);
/// Its inverse: ERROR for any code that is none of these.
std::int8_t outcome_of_exit_code(int code);

}  // namespace berth::evaluation
