// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "common/core/config.h"
#include "procedures/language/schema.h"
#include "procedures/language/steps.h"

namespace berth::procedures {

/// The keys that every step may have in addition to its verb.
const std::vector<KeyInfo>& step_keys();

/// The key `on_failure` of a step or block. @param default_value without the key
OnFailure read_on_failure(Config& step, OnFailure default_value);
/// The key `when_lost` of a step or block; nothing where there is none.
std::optional<WhenLost> read_when_lost(Config& step);
/// The key `if`; nothing where there is none.
std::optional<Condition> read_if(Config& step);

/// The values of the key `frozen`: none, replica, sensor.
const std::vector<std::string>& frozen_arms();
/// As in testbed_command2_t::frozen_arm; -1: no such word.
int frozen_arm_of(const std::string& word);

}  // namespace berth::procedures
