// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "app/console/server/server.h"
#include "common/bus/node.h"

namespace berth::console {

/// The console on the bus. Board and server must outlive it.
std::unique_ptr<Node> make_console_node(const NodeSetup& setup, Board& board, Server& server,
                                        Bus& bus, Loop& loop);

}  // namespace berth::console
