// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>

#include "common/bus/loop.h"
#include "common/bus/wire.h"

namespace berth {

/// Both ends of a byte stream within one thread: what is written at one is readable a latency later
/// at the other, whose loop says so. As a socket it takes only so much that nobody reads.
std::pair<std::unique_ptr<Wire>, std::unique_ptr<Wire>> make_memory_wire(Loop& one, Loop& other,
                                                                         Utime latency);

}  // namespace berth
