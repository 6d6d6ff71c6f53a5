// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/process_loop.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <system_error>

#include "common/core/error.h"

namespace berth {
namespace {

Utime monotonic() {
  using namespace std::chrono;
  return duration_cast<microseconds>(steady_clock::now().time_since_epoch()).count();
}

[[noreturn]] void throw_errno(const std::string& what) {
  throw std::system_error(errno, std::generic_category(), what);
}

}  // namespace

Utime clock_offset_now() {
  using namespace std::chrono;
  return duration_cast<microseconds>(system_clock::now().time_since_epoch()).count() - monotonic();
}

Utime clock_offset_from_environment() {
  const char* text = std::getenv("BERTH_CLOCK_OFFSET_US");
  if (text == nullptr) return clock_offset_now();
  char* end = nullptr;
  const long long value = std::strtoll(text, &end, 10);
  if (end == text || *end != '\0') {
    throw InputError(std::string("environment variable BERTH_CLOCK_OFFSET_US: found '") + text +
                     "', expected whole microseconds");
  }
  return value;
}

ProcessLoop::ProcessLoop(Utime clock_offset)
    : clock_offset_(clock_offset), wake_fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (wake_fd_ < 0) throw_errno("eventfd");
}

ProcessLoop::~ProcessLoop() {
  close(wake_fd_);
  if (signal_fd_ >= 0) close(signal_fd_);
}

Utime ProcessLoop::now() const { return monotonic() + clock_offset_; }

Loop::TimerId ProcessLoop::add(Utime when, Utime period, Task task) {
  const TimerId id = next_id_++;
  timer_of_[id] = timers_.emplace(when, Timer{id, period, std::move(task)});
  return id;
}

Loop::TimerId ProcessLoop::at(Utime when, Task task) { return add(when, 0, std::move(task)); }

Loop::TimerId ProcessLoop::every(Utime period, Task task) {
  return add(now() + period, period, std::move(task));
}

void ProcessLoop::cancel(TimerId timer) {
  const auto found = timer_of_.find(timer);
  if (found == timer_of_.end()) return;
  timers_.erase(found->second);
  timer_of_.erase(found);
}

void ProcessLoop::watch(int fd, Task readable) {
  watched_[fd] = {POLLIN, std::make_shared<Task>(std::move(readable))};
}

void ProcessLoop::watch_writable(int fd, Task writable) {
  watched_[fd] = {POLLOUT, std::make_shared<Task>(std::move(writable))};
}

void ProcessLoop::unwatch(int fd) { watched_.erase(fd); }

void ProcessLoop::post(Task task) {
  {
    const std::lock_guard lock(mutex_);
    posted_.push_back(std::move(task));
  }
  wake();
}

void ProcessLoop::stop() {
  post([this] { stopped_ = true; });
}

void ProcessLoop::wake() {
  const std::uint64_t one = 1;
  // A full counter means that the loop is already due to wake.
  [[maybe_unused]] const auto written = write(wake_fd_, &one, sizeof one);
}

void ProcessLoop::on_signals(std::function<void(int)> handler) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  signal_fd_ = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  if (signal_fd_ < 0) throw_errno("signalfd");
  watch(signal_fd_, [this, handler = std::move(handler)] {
    signalfd_siginfo info;
    while (read(signal_fd_, &info, sizeof info) == sizeof info) {
      handler(static_cast<int>(info.ssi_signo));
    }
  });
}

void ProcessLoop::run_posted() {
  std::uint64_t count = 0;
  [[maybe_unused]] const auto got = read(wake_fd_, &count, sizeof count);
  std::vector<Task> tasks;
  {
    const std::lock_guard lock(mutex_);
    tasks.swap(posted_);
  }
  for (const Task& task : tasks) task();
}

void ProcessLoop::run_due_timers() {
  const Utime due = now();
  while (!timers_.empty() && timers_.begin()->first <= due) {
    auto node = timers_.extract(timers_.begin());
    const Timer timer = node.mapped();
    if (timer.period > 0) {
      // A late loop skips beats and stays on the grid.
      const Utime missed = (due - node.key()) / timer.period;
      node.key() += (missed + 1) * timer.period;
      timer_of_[timer.id] = timers_.insert(std::move(node));
    } else {
      timer_of_.erase(timer.id);
    }
    timer.task();
  }
}

void ProcessLoop::run() {
  stopped_ = false;
  std::vector<pollfd> set;
  while (!stopped_) {
    set.assign(1, {wake_fd_, POLLIN, 0});
    for (const auto& [fd, watch] : watched_) set.push_back({fd, watch.events, 0});
    timespec timeout{};
    if (!timers_.empty()) {
      const Utime wait = std::max<Utime>(0, timers_.begin()->first - now());
      timeout.tv_sec = wait / second;
      timeout.tv_nsec = (wait % second) * 1000;
    }
    if (ppoll(set.data(), set.size(), timers_.empty() ? nullptr : &timeout, nullptr) < 0 &&
        errno != EINTR) {
      throw_errno("ppoll");
    }
    run_due_timers();
    if (set[0].revents != 0) run_posted();
    for (std::size_t i = 1; i < set.size(); ++i) {
      if (set[i].revents == 0) continue;
      const auto found = watched_.find(set[i].fd);  // an earlier task may have unwatched it
      if (found == watched_.end()) continue;
      const std::shared_ptr<Task> task = found->second.task;
      (*task)();
    }
  }
}

namespace {

/// Splits "host:port" and looks the host up. @throws InputError.
sockaddr_in resolve(const std::string& address) {
  const auto colon = address.rfind(':');
  const auto complain = [&](const std::string& what) {
    return InputError("address '" + address + "': " + what +
                      ", expected host:port such as 127.0.0.1:502");
  };
  if (colon == std::string::npos) throw complain("has no port");
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const std::string host = address.substr(0, colon);
  const int error = getaddrinfo(host.c_str(), address.substr(colon + 1).c_str(), &hints, &found);
  if (error != 0) throw complain(gai_strerror(error));
  sockaddr_in result{};
  std::copy_n(reinterpret_cast<const char*>(found->ai_addr), sizeof result,
              reinterpret_cast<char*>(&result));
  freeaddrinfo(found);
  return result;
}

void send_small_frames_at_once(int fd) {
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

}  // namespace

TcpWires::~TcpWires() {
  for (const int fd : listening_) {
    loop_.unwatch(fd);
    close(fd);
  }
}

void TcpWires::dial(const std::string& address, Connected connected) {
  const sockaddr_in to = resolve(address);
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) throw_errno("socket");
  send_small_frames_at_once(fd);
  const auto finish = [this, fd, connected] {
    loop_.unwatch(fd);
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error == 0) return connected(fd);
    close(fd);
    connected(-1);
  };
  if (connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 && errno != EINPROGRESS) {
    close(fd);
    // Through the loop, so that a caller is never called back from inside its own call.
    loop_.at(loop_.now(), [connected = std::move(connected)] { connected(-1); });
    return;
  }
  loop_.watch_writable(fd, finish);
}

void TcpWires::listen(const std::string& address, Connected accepted) {
  const sockaddr_in at = resolve(address);
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) throw_errno("socket");
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 || ::listen(fd, 16) != 0) {
    const std::string why = std::generic_category().message(errno);
    close(fd);
    throw InputError("address '" + address + "' cannot be listened on: " + why);
  }
  listening_.push_back(fd);
  loop_.watch(fd, [fd, accepted = std::move(accepted)] {
    const int connection = accept4(fd, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (connection < 0) return;
    send_small_frames_at_once(connection);
    accepted(connection);
  });
}

}  // namespace berth
