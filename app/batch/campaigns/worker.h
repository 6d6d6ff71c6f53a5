// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <functional>
#include <optional>

#include "app/batch/campaigns/runner.h"
#include "common/core/child_process.h"

namespace berth::campaigns {

/// A worker process, as its parent sees it. It takes blocks one after the other and tells of each
/// trial that is done. It dies with its parent.
class Worker {
 public:
  /// Forks. @throws std::system_error when there are no more processes to be had.
  Worker(const Campaign& campaign,
         const std::function<std::unique_ptr<Experiment>()>& make_experiment);
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Only when idle. What is in the block's started file is taken over.
  void begin(const Block& block);
  /// No more blocks will come: it ends.
  void finish();
  /// Ends it at once.
  void stop();

  /// Readable when the worker has something to say, or has ended.
  int descriptor() const { return from_worker_; }
  /// Takes in what it said. @return false when it has ended
  bool listen();
  /// Only after its end.
  const ProcessEnd& end() const { return end_; }

  const std::optional<Block>& block() const { return block_; }
  bool idle() const { return ready_ && !block_ && to_worker_ >= 0; }
  bool was_ready() const { return ready_; }
  std::int64_t in_block() const { return in_block_; }  ///< trials of its block that are done
  const std::string& error() const { return error_; }  ///< why it gave up; empty: it did not
  std::int64_t finished() const { return finished_; }  ///< trials of blocks that it finished
  std::int64_t ran() const { return ran_; }            ///< trials that it ran itself

 private:
  void take_line(const std::string& line);
  void reap();

  std::optional<ChildProcess> child_;
  int to_worker_ = -1;
  int from_worker_ = -1;
  std::string heard_;  // the line that is not whole yet
  std::optional<Block> block_;
  bool ready_ = false;
  std::int64_t in_block_ = 0;
  std::int64_t finished_ = 0;
  std::int64_t ran_ = 0;
  ProcessEnd end_;
  std::string error_;
};

}  // namespace berth::campaigns
