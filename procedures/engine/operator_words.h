// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/facility_command_t.hpp>
#include <berth/facility_state_t.hpp>
#include <string>

namespace berth::procedures {

/// A speed override, "60 %", as 0..1. @throws InputError.
double speed_override_of(const std::string& text);

/// What is requested of the lamps, as a lights step has it: "sun: 80 %, albedo: 10 %". What it does
/// not name stays as it is now. @throws InputError.
facility_command_t lamps_of(const std::string& text, const facility_state_t& now);

}  // namespace berth::procedures
