// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "common/bus/process_loop.h"
#include "common/core/child_process.h"

namespace berth {

/// A program started by us, its output appended to a file, whose end is reported on the loop. It
/// dies with its parent, and with this object.
class WatchedProcess {
 public:
  using Ended = std::function<void(const ProcessEnd&)>;

  /// @param arguments the first is the program
  /// @param ended may not destroy this object
  /// @throws InputError when the program cannot be started or the file not be written.
  WatchedProcess(ProcessLoop& loop, const std::vector<std::string>& arguments,
                 const std::filesystem::path& output, Ended ended);
  ~WatchedProcess();

  bool running() const { return child_.running(); }
  void signal(int number) const { child_.signal(number); }

 private:
  ProcessLoop& loop_;
  ChildProcess child_;
};

/// The last line that is not empty of a program's output; empty when there is none.
std::string last_line(const std::filesystem::path& output);

}  // namespace berth
