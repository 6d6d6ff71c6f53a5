// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "app/console/control/command_handler.h"
#include "app/runs/run_files.h"
#include "app/runs/watched_process.h"

namespace berth::console {

/// Runs procedures in the cell that is up, as "berth run --detach" in another terminal would: they
/// are checked first, and outlive the console.
class RunStarter {
 public:
  /// ended: exit code of "berth run", and its last output.
  using Ended = std::function<void(int code, const std::string& words)>;

  RunStarter(const RunFiles& cell, ProcessLoop& loop, Ended ended)
      : cell_(cell), loop_(loop), ended_(std::move(ended)) {}

  /// @return why it is not started; empty: it is being checked, and then started.
  std::string start(const RunOrder& order);

 private:
  std::filesystem::path output() const { return cell_.directory / "output" / "console-run.txt"; }

  const RunFiles& cell_;
  ProcessLoop& loop_;
  Ended ended_;
  std::unique_ptr<WatchedProcess> child_;
};

}  // namespace berth::console
