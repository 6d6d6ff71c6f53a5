// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "testbed/motion/arm_pair.h"

namespace berth {

/// Where the arms of a cell that is up stand, by what their drivers report; nothing when one of
/// them reports nothing within a second. @throws InputError as LcmBus.
std::optional<testbed::ArmPair> arms_now(const std::string& url, std::int64_t session);

}  // namespace berth
