// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>

namespace berth {

/// Calls task(0) ... task(count - 1), so many at a time, each on a thread of this process; returns
/// when all are done. What they make must not depend on their order. An exception of a task is
/// thrown on, that of the lowest number, when all have ended.
/// @param jobs 0: as many as the machine has processors
void in_parallel(std::size_t count, unsigned jobs, const std::function<void(std::size_t)>& task);

}  // namespace berth
