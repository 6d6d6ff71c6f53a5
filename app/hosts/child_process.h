// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/process_loop.h"

namespace berth {

/// A process by a descriptor (pidfd), which stands for no other process when its number is used
/// again.
class ProcessHandle {
 public:
  explicit ProcessHandle(pid_t pid);
  ~ProcessHandle();
  ProcessHandle(const ProcessHandle&) = delete;
  ProcessHandle& operator=(const ProcessHandle&) = delete;

  /// Readable when the process ends; -1 when there was no such process.
  int descriptor() const { return fd_; }
  void signal(int number) const;
  /// Waits at most so long. @return whether it has ended, or never was.
  bool ends_within(std::chrono::milliseconds time) const;

 private:
  int fd_;
};

/// One program started by us, its output in a file. It dies with its parent.
class ChildProcess {
 public:
  /// exited gets the exit code, or 128 + signal, on the loop.
  /// @throws InputError when the program cannot be started.
  ChildProcess(ProcessLoop& loop, std::string name, const std::filesystem::path& program,
               const std::vector<std::string>& arguments, const std::filesystem::path& output,
               std::function<void(int)> exited);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }
  bool running() const { return pid_ > 0; }
  void signal(int number) const;

 private:
  void reap(const std::function<void(int)>& exited);

  ProcessLoop& loop_;
  std::string name_;
  pid_t pid_ = -1;
  std::optional<ProcessHandle> process_;
};

}  // namespace berth
