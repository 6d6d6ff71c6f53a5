// SPDX-License-Identifier: BSD-3-Clause
#include "app/hosts/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "common/core/error.h"

namespace berth {
namespace {

/// Between fork and exec: only what is safe there.
[[noreturn]] void become(const char* program, char* const* arguments, int output, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it died before the line above
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(output, STDERR_FILENO);
  execvp(program, arguments);
  dprintf(STDERR_FILENO, "cannot start %s\n", program);
  _exit(127);
}

}  // namespace

// glibc 2.36 declares its functions of pidfd without C linkage.
ProcessHandle::ProcessHandle(pid_t pid) : fd_(static_cast<int>(syscall(SYS_pidfd_open, pid, 0))) {}

ProcessHandle::~ProcessHandle() {
  if (fd_ >= 0) close(fd_);
}

void ProcessHandle::signal(int number) const {
  if (fd_ >= 0) syscall(SYS_pidfd_send_signal, fd_, number, nullptr, 0);
}

bool ProcessHandle::ends_within(std::chrono::milliseconds time) const {
  if (fd_ < 0) return true;
  const auto end = std::chrono::steady_clock::now() + time;
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(
        std::max(end - std::chrono::steady_clock::now(), std::chrono::nanoseconds(0)));
    pollfd ended{fd_, POLLIN, 0};
    const int n = poll(&ended, 1, static_cast<int>(left.count()));
    if (n >= 0 || errno != EINTR) return n > 0;
  }
}

ChildProcess::ChildProcess(ProcessLoop& loop, std::string name,
                           const std::filesystem::path& program,
                           const std::vector<std::string>& arguments,
                           const std::filesystem::path& output, std::function<void(int)> exited)
    : loop_(loop), name_(std::move(name)) {
  const int out = open(output.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (out < 0) throw InputError(output.string() + ": cannot be written");
  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t self = getpid();
  pid_ = fork();
  if (pid_ == 0) become(argv[0], argv.data(), out, self);
  close(out);
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  process_.emplace(pid_);
  if (process_->descriptor() < 0) {
    throw std::system_error(errno, std::generic_category(), "pidfd_open");
  }
  loop_.watch(process_->descriptor(), [this, exited = std::move(exited)] { reap(exited); });
}

ChildProcess::~ChildProcess() {
  if (pid_ > 0) {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  if (process_) loop_.unwatch(process_->descriptor());
}

void ChildProcess::signal(int number) const {
  if (pid_ > 0) kill(pid_, number);
}

void ChildProcess::reap(const std::function<void(int)>& exited) {
  int status = 0;
  if (waitpid(pid_, &status, WNOHANG) != pid_) return;
  pid_ = -1;
  loop_.unwatch(process_->descriptor());
  exited(WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
}

}  // namespace berth
