// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "app/batch/campaigns/runner.h"

namespace berth::campaigns {

/// What a worker process tells its parent, in memory that they share.
struct WorkerReport {
  static constexpr std::int64_t none = -1;
  std::atomic<bool> ready = false;         ///< its experiment is made
  std::atomic<std::int64_t> block = none;  ///< that it is at work on
  std::atomic<std::int64_t> in_block = 0;  ///< trials of that block that are done
  std::atomic<std::int64_t> finished = 0;  ///< trials of blocks that are finished
  std::atomic<std::int64_t> ran = 0;       ///< trials that it ran itself
};

/// What a worker process does: the block named first, then those that no worker has taken, one
/// after the other. Their files are written whole or not at all; what an earlier worker left of a
/// block (its .started file) is taken over.
/// @param first of the blocks, or WorkerReport::none
/// @param next of those that no worker has taken, shared by all
/// @throws what the making of its experiment, or a block's files, threw
void work(const Campaign& campaign, const std::vector<Block>& blocks,
          const std::function<std::unique_ptr<Experiment>()>& make_experiment, std::int64_t first,
          std::atomic<std::int64_t>& next, WorkerReport& report);

}  // namespace berth::campaigns
