// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "drivers/lidar/connection.h"

namespace berth {

class SimulatedLoop;

namespace lidar {

/// Conversations in the twin: messages as values, at most the simulation's wire latency later.
void dial_memory(SimulatedLoop& loop, const std::string& address, Connected connected);
/// @throws InputError when the address is served already.
void listen_memory(SimulatedLoop& loop, const std::string& address, Accepted accepted);

}  // namespace lidar
}  // namespace berth
