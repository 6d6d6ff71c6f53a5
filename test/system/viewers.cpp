// SPDX-License-Identifier: BSD-3-Clause
// viewers PORT COUNT SECONDS [SLOW_BYTES_PER_S]: so many viewers of the console at /live for so
// long, and one more that reads no faster than given. Prints what each got.
#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// One viewer: counts the frames in what the server sends.
class Viewer {
 public:
  /// bytes_per_s: 0: as fast as they come.
  Viewer(std::uint16_t port, double bytes_per_s) : bytes_per_s_(bytes_per_s) {
    fd_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const int buffer = 8192;
    if (bytes_per_s > 0) setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const std::string request =
        "GET /live HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    if (connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
        ::send(fd_, request.data(), request.size(), MSG_NOSIGNAL) < 0) {
      std::perror("viewers: no console");
      std::exit(2);
    }
  }
  ~Viewer() { close(fd_); }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  int descriptor() const { return fd_; }
  bool may_read(Clock::time_point start) const {
    return open_ &&
           (bytes_per_s_ <= 0 || static_cast<double>(bytes_) < bytes_per_s_ * seconds_since(start));
  }

  void read() {
    char buffer[4096];
    const ssize_t size = recv(fd_, buffer, sizeof buffer, MSG_DONTWAIT);
    if (size == 0) open_ = false;
    if (size <= 0) return;
    bytes_ += size;
    received_.append(buffer, static_cast<std::size_t>(size));
    take_frames();
  }

  void print(const char* name, double seconds) const {
    std::printf("%-8s %7.1f messages/s %9.0f bytes/s%s\n", name, messages_ / seconds,
                static_cast<double>(bytes_) / seconds, open_ ? "" : "  (was cut off)");
  }

 private:
  void take_frames() {
    if (!upgraded_) {
      const auto end = received_.find("\r\n\r\n");
      if (end == std::string::npos) return;
      upgraded_ = received_.compare(9, 3, "101") == 0;
      if (!upgraded_) {
        std::fprintf(stderr, "viewers: refused: %s\n", received_.c_str());
        std::exit(2);
      }
      received_.erase(0, end + 4);
    }
    for (std::size_t size = 0; (size = frame_size()) > 0 && received_.size() >= size;) {
      if ((received_[0] & 0x0f) == 9) answer_ping();
      messages_ += (received_[0] & 0x0f) == 1 ? 1 : 0;
      received_.erase(0, size);
    }
  }

  /// Of the first frame, with its head; 0: not known yet.
  std::size_t frame_size() const {
    const auto byte = [this](std::size_t i) { return static_cast<unsigned char>(received_[i]); };
    if (received_.size() < 2) return 0;
    const std::size_t length_bytes = byte(1) == 126 ? 2 : byte(1) == 127 ? 8 : 0;
    if (received_.size() < 2 + length_bytes) return 0;
    std::size_t size = length_bytes == 0 ? byte(1) : 0;
    for (std::size_t i = 0; i < length_bytes; ++i) size = size << 8U | byte(2 + i);
    return 2 + length_bytes + size;
  }

  void answer_ping() const {
    const char pong[] = {'\x8a', '\x80', 0, 0, 0, 0};
    ::send(fd_, pong, sizeof pong, MSG_NOSIGNAL | MSG_DONTWAIT);
  }

  int fd_ = -1;
  double bytes_per_s_;
  std::string received_;
  bool upgraded_ = false;
  bool open_ = true;
  long messages_ = 0;
  long bytes_ = 0;
};

}  // namespace

int main(int argc, char* argv[]) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: viewers PORT COUNT SECONDS [SLOW_BYTES_PER_S]\n");
    return 2;
  }
  const auto port = static_cast<std::uint16_t>(std::atoi(argv[1]));
  const double duration = std::atof(argv[3]);
  std::vector<std::unique_ptr<Viewer>> viewers;
  for (int i = 0; i < std::atoi(argv[2]); ++i) viewers.push_back(std::make_unique<Viewer>(port, 0));
  const std::size_t quick = viewers.size();
  if (argc > 4) viewers.push_back(std::make_unique<Viewer>(port, std::atof(argv[4])));
  const auto start = Clock::now();
  while (seconds_since(start) < duration) {
    std::vector<pollfd> ready;
    std::vector<Viewer*> of;
    for (const auto& viewer : viewers) {
      if (!viewer->may_read(start)) continue;
      ready.push_back({viewer->descriptor(), POLLIN, 0});
      of.push_back(viewer.get());
    }
    poll(ready.data(), ready.size(), 20);
    for (std::size_t i = 0; i < ready.size(); ++i) {
      if (ready[i].revents != 0) of[i]->read();
    }
  }
  for (std::size_t i = 0; i < viewers.size(); ++i) {
    viewers[i]->print(i < quick ? "viewer" : "slow one", seconds_since(start));
  }
  return 0;
}
