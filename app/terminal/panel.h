// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/procedure_state_t.hpp>
#include <vector>

#include "app/terminal/style.h"

namespace berth::terminal {

/// The present state of a running procedure: its step, those done and those to come, preconditions
/// that are not met, limits with their margins, the open prompt.
std::vector<Line> panel(const procedure_state_t& state);

/// "ok   name   what is found", green or red.
Line line_of(const precondition_t& precondition);

/// "PREPARING", "RUNNING", "HELD", "WAITS FOR AN ANSWER", "TEARDOWN" or "FINISHED".
const char* text_of_state(std::int8_t state);
/// "done", "FAILED", ... of a step that has ended; empty before.
const char* text_of_step(std::int8_t step_state);
Style style_of_step(std::int8_t step_state);
/// "[yes / no]"; empty when any answer will do.
std::string choices_of(const procedure_state_t& state);

}  // namespace berth::terminal
