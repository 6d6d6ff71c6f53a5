// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/testbed_command2_t.hpp>
#include <optional>

#include "procedures/language/procedure.h"

namespace berth::procedures {

/// With the identity as its pose, all else unset.
testbed_command2_t testbed_command_of(std::int8_t what);

/// What a step requests of the testbed; nothing when it requests no motion. here: where the replica
/// is commanded to be as the step begins (T_sensor_model), for a step that keeps it there.
std::optional<testbed_command2_t> motion_command(const Verb& verb, const Pose& here);

}  // namespace berth::procedures
