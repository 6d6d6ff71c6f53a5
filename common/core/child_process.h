// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace berth {

/// How a process ended.
struct ProcessEnd {
  int exit_status = 0;  ///< what it returned; of no meaning after a signal
  int signal = 0;       ///< that killed it; 0: it exited
  double user_s = 0;    ///< processor time
  double system_s = 0;

  /// As shells have it: the exit status, or 128 + signal.
  int code() const { return signal == 0 ? exit_status : 128 + signal; }
  bool ok() const { return code() == 0; }
  /// "exit code 2" or "SIGSEGV".
  std::string name() const;
  /// "ended with exit code 2" or "died of SIGSEGV (Segmentation fault)".
  std::string text() const;
};

/// A process by a descriptor (pidfd), which stands for no other process when its number is used
/// again. May be moved.
class ProcessHandle {
 public:
  ProcessHandle() = default;  ///< of none
  explicit ProcessHandle(pid_t pid);
  ~ProcessHandle();
  ProcessHandle(ProcessHandle&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  ProcessHandle& operator=(ProcessHandle&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }

  /// Readable when the process has ended; -1 when there was no such process.
  int descriptor() const { return fd_; }
  void signal(int number) const;
  /// Waits at most so long. @return whether it has ended, or never was.
  bool ends_within(std::chrono::milliseconds time) const;

 private:
  int fd_ = -1;
};

/// How a child process is started.
struct ChildOptions {
  std::vector<std::pair<std::string, std::string>> environment;  ///< added to our own
  int input = -1;   ///< descriptor of its standard input; -1: /dev/null
  int output = -1;  ///< and of its standard output; -1: ours
  int errors = -1;  ///< and of its standard error; -1: ours
  /// File to which output and errors are appended instead; empty: the descriptors above apply.
  std::filesystem::path output_file;
  bool dies_with_parent = true;
  bool outlives_object = false;  ///< it is not killed when its object is destroyed
  bool own_session = false;      ///< the terminal's signals and its end do not reach it
};

/// A process that we started. One that is still there at the end of this object is killed, unless
/// it was started to outlive it.
class ChildProcess {
 public:
  /// Starts another program, without a shell.
  /// @param arguments the first is the program, of the PATH when it has no slash
  /// @throws InputError when it cannot be started or its output file not be written.
  ChildProcess(const std::vector<std::string>& arguments, const ChildOptions& options);
  /// Forks this process, in one thread; the copy exits with the value that `body` returns.
  /// Destructors of the parent's objects do not run there. @throws std::system_error when there are
  /// no more processes, InputError when its output file cannot be written.
  ChildProcess(const std::function<int()>& body, const ChildOptions& options);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  pid_t pid() const { return pid_; }
  bool running() const { return running_; }
  /// Readable when it has ended.
  int descriptor() const { return handle_.descriptor(); }
  void signal(int number) const;
  /// Waits for its end.
  ProcessEnd wait();
  /// Nothing when it has not ended by then.
  std::optional<ProcessEnd> wait_for(std::chrono::milliseconds time);

 private:
  void start(const ChildOptions& options, const std::function<void()>& child);
  ProcessEnd reap();

  pid_t pid_ = -1;
  bool running_ = false;
  bool outlives_object_ = false;
  ProcessHandle handle_;
};

/// Becomes another program. @throws InputError when that cannot be.
[[noreturn]] void become_program(const std::vector<std::string>& arguments);

struct ProgramOutput {
  ProcessEnd end;
  std::string text;    ///< its standard output
  std::string errors;  ///< its standard error
};

/// Runs a program until it ends. @throws InputError when it cannot be started.
ProgramOutput run_program(const std::vector<std::string>& arguments);

/// Runs a program with a text on its standard input, which it need not read; what it prints goes
/// where ours goes. @throws InputError when it cannot be started.
ProcessEnd feed_program(const std::vector<std::string>& arguments, const std::string& input,
                        const std::vector<std::pair<std::string, std::string>>& environment);

}  // namespace berth
