// SPDX-License-Identifier: BSD-3-Clause
// What may be wrong with the machine that a program runs on; loaded before its libraries, with
// LD_PRELOAD:
//   BERTH_TEST_PACKET_LOSS=0.2   that share of the datagrams received are lost
//   BERTH_TEST_LOOP=1            a thread that gets SIGUSR2 is in an endless loop from then on
//   BERTH_TEST_CLOCK=FILE        the system's clock, not the monotonic one, is off by the
//   microseconds that stand in the
//                                file's first eight bytes, from the moment they are written
#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <random>

namespace {

template <class Function>
Function original(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

double loss() {
  static const double share = [] {
    const char* text = std::getenv("BERTH_TEST_PACKET_LOSS");
    return text != nullptr ? std::atof(text) : 0.0;
  }();
  return share;
}

bool lost(int fd) {
  if (loss() <= 0) return false;
  int type = 0;
  socklen_t size = sizeof type;
  if (getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return false;
  thread_local std::mt19937 random(static_cast<unsigned>(getpid()));
  return std::uniform_real_distribution<>(0, 1)(random) < loss();
}

/// Loops in the midst of whatever the thread did.
[[gnu::constructor]] void expect_to_loop() {
  if (std::getenv("BERTH_TEST_LOOP") == nullptr) return;
  signal(SIGUSR2, [](int) {
    for (volatile bool endless = true; endless;) {
    }
  });
}

/// us to add to the system's clock.
std::int64_t step() {
  static const std::atomic<std::int64_t>* const shared = []() -> std::atomic<std::int64_t>* {
    const char* file = std::getenv("BERTH_TEST_CLOCK");
    if (file == nullptr) return nullptr;
    const int fd = open(file, O_RDONLY | O_CLOEXEC);
    if (fd < 0) return nullptr;
    void* const place = mmap(nullptr, sizeof(std::int64_t), PROT_READ, MAP_SHARED, fd, 0);
    close(fd);
    return place == MAP_FAILED ? nullptr : static_cast<std::atomic<std::int64_t>*>(place);
  }();
  return shared != nullptr ? shared->load() : 0;
}

}  // namespace

extern "C" {

/// A lost packet comes as one too short to be any, which its receiver throws away: to wait here for
/// the next would keep it from noticing that it is to end.
ssize_t recvmsg(int fd, msghdr* message, int flags) {
  static const auto real = original<ssize_t (*)(int, msghdr*, int)>("recvmsg");
  const ssize_t size = real(fd, message, flags);
  return size > 0 && lost(fd) ? 1 : size;
}

int clock_gettime(clockid_t clock, timespec* now) {
  static const auto real = original<int (*)(clockid_t, timespec*)>("clock_gettime");
  const int result = real(clock, now);
  if (result == 0 && clock == CLOCK_REALTIME) now->tv_sec += step() / 1000000;
  return result;
}

int gettimeofday(timeval* now, void* zone) {
  static const auto real = original<int (*)(timeval*, void*)>("gettimeofday");
  const int result = real(now, zone);
  if (result == 0) now->tv_sec += step() / 1000000;
  return result;
}
}
