// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include "common/core/error.h"

namespace berth {
namespace {

using std::chrono::milliseconds;

/// The end of a pipe, or a file. Not inherited by programs.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { close(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  void close() {
    if (fd_ >= 0) ::close(std::exchange(fd_, -1));
  }
  void set(int fd) { fd_ = fd; }
  int get() const { return fd_; }

 private:
  int fd_;
};

struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0) {
      throw std::system_error(errno, std::generic_category(), "pipe");
    }
    out.set(ends[0]);
    in.set(ends[1]);
  }
  Descriptor out;  // to be read
  Descriptor in;   // to be written
};

std::vector<char*> pointers_to(std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

/// NAME=VALUE: our environment, with the new variables added or replaced.
std::vector<std::string> environment_with(
    const std::vector<std::pair<std::string, std::string>>& more) {
  std::vector<std::string> all;
  for (char** one = environ; *one != nullptr; ++one) {
    const std::string text = *one;
    const bool replaced = std::any_of(more.begin(), more.end(), [&](const auto& pair) {
      return text.compare(0, pair.first.size() + 1, pair.first + "=") == 0;
    });
    if (!replaced) all.push_back(text);
  }
  for (const auto& [name, value] : more) all.push_back(name + "=" + value);
  return all;
}

double seconds_of(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

InputError not_started(const std::string& program, int error) {
  return InputError(program + ": cannot be started: " + strerror(error));
}

/// Reads both pipes at once: a program that fills one while we wait for the other would block for
/// ever.
void read_both(int text, int errors, ProgramOutput& into) {
  std::array<pollfd, 2> from = {{{text, POLLIN, 0}, {errors, POLLIN, 0}}};
  const std::array<std::string*, 2> texts = {&into.text, &into.errors};
  while (from[0].fd >= 0 || from[1].fd >= 0) {
    if (poll(from.data(), from.size(), -1) < 0 && errno != EINTR) return;
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (from[i].fd < 0 || from[i].revents == 0) continue;
      std::array<char, 4096> bytes;
      const ssize_t count = read(from[i].fd, bytes.data(), bytes.size());
      if (count > 0) texts[i]->append(bytes.data(), static_cast<std::size_t>(count));
      if (count == 0 || (count < 0 && errno != EINTR)) from[i].fd = -1;  // poll leaves it out
    }
  }
}

}  // namespace

std::string ProcessEnd::name() const {
  if (signal == 0) return "exit code " + std::to_string(exit_status);
  const char* abbreviation = sigabbrev_np(signal);
  return abbreviation == nullptr ? "signal " + std::to_string(signal)
                                 : std::string("SIG") + abbreviation;
}

std::string ProcessEnd::text() const {
  if (signal == 0) return "ended with " + name();
  const char* description = sigdescr_np(signal);
  return "died of " + name() +
         (description == nullptr ? "" : std::string(" (") + description + ")");
}

// glibc 2.36 declares its functions of pidfd without C linkage.
ProcessHandle::ProcessHandle(pid_t pid) : fd_(static_cast<int>(syscall(SYS_pidfd_open, pid, 0))) {}

ProcessHandle::~ProcessHandle() {
  if (fd_ >= 0) close(fd_);
}

void ProcessHandle::signal(int number) const {
  if (fd_ >= 0) syscall(SYS_pidfd_send_signal, fd_, number, nullptr, 0);
}

bool ProcessHandle::ends_within(milliseconds time) const {
  if (fd_ < 0) return true;
  const auto end = std::chrono::steady_clock::now() + time;
  for (;;) {
    const auto left = std::chrono::ceil<milliseconds>(
        std::max(end - std::chrono::steady_clock::now(), std::chrono::nanoseconds(0)));
    pollfd ended{fd_, POLLIN, 0};
    const int n = poll(&ended, 1, static_cast<int>(left.count()));
    if (n >= 0 || errno != EINTR) return n > 0;
  }
}

ChildProcess::ChildProcess(const std::vector<std::string>& arguments, const ChildOptions& options) {
  std::vector<std::string> words = arguments;
  std::vector<std::string> environment = environment_with(options.environment);
  const std::vector<char*> argv = pointers_to(words);
  const std::vector<char*> envp = pointers_to(environment);
  Pipe trouble;  // closed by the kernel when the program runs, else it receives the error
  start(options, [&] {
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    execvpe(argv[0], argv.data(), envp.data());
    const int error = errno;
    [[maybe_unused]] const ssize_t n = write(trouble.in.get(), &error, sizeof error);
    _exit(127);
  });
  trouble.in.close();
  int error = 0;
  ssize_t n = 0;
  while ((n = read(trouble.out.get(), &error, sizeof error)) < 0 && errno == EINTR) {
  }
  if (n != sizeof error) return;
  reap();
  throw not_started(arguments.front(), error);
}

ChildProcess::ChildProcess(const std::function<int()>& body, const ChildOptions& options) {
  std::fflush(nullptr);
  start(options, [&] {
    const int code = body();
    std::fflush(nullptr);
    _exit(code);
  });
}

ChildProcess::~ChildProcess() {
  if (!running_ || outlives_object_) return;
  signal(SIGKILL);
  reap();
}

/// Forks. Between fork and exec only what is safe there: others of our threads may hold locks.
void ChildProcess::start(const ChildOptions& options, const std::function<void()>& child) {
  Descriptor nothing;
  if (options.input < 0) nothing.set(open("/dev/null", O_RDONLY | O_CLOEXEC));
  Descriptor file;
  if (!options.output_file.empty()) {
    file.set(open(options.output_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
    if (file.get() < 0) throw InputError(options.output_file.string() + ": cannot be written");
  }
  const std::array<int, 3> streams = {options.input < 0 ? nothing.get() : options.input,
                                      file.get() < 0 ? options.output : file.get(),
                                      file.get() < 0 ? options.errors : file.get()};
  // The terminal may close at any moment: between fork and setsid, too.
  sigset_t hangup;
  sigset_t before;
  sigemptyset(&hangup);
  sigaddset(&hangup, SIGHUP);
  if (options.own_session) sigprocmask(SIG_BLOCK, &hangup, &before);
  const pid_t self = getpid();
  pid_ = fork();
  if (pid_ == 0) {
    if (options.own_session) {
      setsid();
      ::signal(SIGHUP, SIG_IGN);  // of its own children as well: they inherit it
      sigprocmask(SIG_SETMASK, &before, nullptr);
    }
    if (options.dies_with_parent) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != self) _exit(127);  // it died before the line above
    }
    for (int i = 0; i < 3; ++i) {
      const int stream = streams[static_cast<std::size_t>(i)];
      if (stream >= 0) dup2(stream, i);
    }
    child();
    _exit(127);
  }
  const int error = errno;
  if (options.own_session) sigprocmask(SIG_SETMASK, &before, nullptr);
  if (pid_ < 0) throw std::system_error(error, std::generic_category(), "fork");
  running_ = true;
  outlives_object_ = options.outlives_object;
  handle_ = ProcessHandle(pid_);
  if (handle_.descriptor() >= 0) return;
  const int no_handle = errno;
  kill(pid_, SIGKILL);
  reap();
  throw std::system_error(no_handle, std::generic_category(), "pidfd_open");
}

void ChildProcess::signal(int number) const {
  if (running_) handle_.signal(number);
}

ProcessEnd ChildProcess::reap() {
  int status = 0;
  rusage usage{};
  while (wait4(pid_, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  running_ = false;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 0, WIFSIGNALED(status) ? WTERMSIG(status) : 0,
          seconds_of(usage.ru_utime), seconds_of(usage.ru_stime)};
}

ProcessEnd ChildProcess::wait() { return running_ ? reap() : ProcessEnd{}; }

std::optional<ProcessEnd> ChildProcess::wait_for(milliseconds time) {
  if (!running_ || !handle_.ends_within(time)) return std::nullopt;
  return reap();
}

void become_program(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = arguments;
  const std::vector<char*> argv = pointers_to(words);
  std::fflush(nullptr);
  execvp(argv[0], argv.data());
  throw not_started(arguments.front(), errno);
}

ProgramOutput run_program(const std::vector<std::string>& arguments) {
  Pipe text;
  Pipe errors;
  ChildOptions options;
  options.output = text.in.get();
  options.errors = errors.in.get();
  ChildProcess child(arguments, options);
  text.in.close();
  errors.in.close();
  ProgramOutput output;
  read_both(text.out.get(), errors.out.get(), output);
  output.end = child.wait();
  return output;
}

ProcessEnd feed_program(const std::vector<std::string>& arguments, const std::string& input,
                        const std::vector<std::pair<std::string, std::string>>& environment) {
  Pipe to_program;
  ChildOptions options;
  options.environment = environment;
  options.input = to_program.out.get();
  std::fflush(nullptr);
  ChildProcess child(arguments, options);
  to_program.out.close();
  const auto before = ::signal(SIGPIPE, SIG_IGN);  // a program that does not read must not end us
  std::size_t written = 0;
  while (written < input.size()) {
    const ssize_t n = write(to_program.in.get(), input.data() + written, input.size() - written);
    if (n < 0 && errno != EINTR) break;
    if (n > 0) written += static_cast<std::size_t>(n);
  }
  ::signal(SIGPIPE, before);
  to_program.in.close();
  return child.wait();
}

}  // namespace berth
