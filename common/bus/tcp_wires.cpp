// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/tcp_wires.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "common/core/error.h"

namespace berth {
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

/// Owns its descriptor.
class SocketWire final : public Wire {
 public:
  SocketWire(ProcessLoop& loop, int fd) : loop_(loop), fd_(fd) {
    const int on = 1;  // small frames leave at once
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  }
  ~SocketWire() override {
    loop_.unwatch(fd_);
    close(fd_);
  }
  SocketWire(const SocketWire&) = delete;
  SocketWire& operator=(const SocketWire&) = delete;

  std::optional<std::size_t> read(std::span<std::uint8_t> into) override {
    const ssize_t size = recv(fd_, into.data(), into.size(), MSG_DONTWAIT);
    return size == 0 ? std::nullopt : taken(size);
  }
  std::optional<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    return taken(send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
  }
  void watch(Readable readable) override { loop_.watch(fd_, std::move(readable)); }
  void unwatch() override { loop_.unwatch(fd_); }

 private:
  static std::optional<std::size_t> taken(ssize_t size) {
    if (size >= 0) return static_cast<std::size_t>(size);
    const bool later = errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
    return later ? std::optional<std::size_t>(0) : std::nullopt;
  }

  ProcessLoop& loop_;
  int fd_;
};

int stream_socket() {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "socket");
  return fd;
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
  const int fd = stream_socket();
  const auto finish = [this, fd, connected] {
    loop_.unwatch(fd);
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error == 0) return connected(std::make_unique<SocketWire>(loop_, fd));
    close(fd);
    connected(nullptr);
  };
  if (connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 && errno != EINPROGRESS) {
    close(fd);
    // Through the loop, so that a caller is never called back from inside its own call.
    loop_.at(loop_.now(), [connected = std::move(connected)] { connected(nullptr); });
    return;
  }
  loop_.watch_writable(fd, finish);
}

void TcpWires::listen(const std::string& address, Connected accepted) {
  const sockaddr_in at = resolve(address);
  const int fd = stream_socket();
  const int on = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0 || ::listen(fd, 16) != 0) {
    const std::string why = std::generic_category().message(errno);
    close(fd);
    throw InputError("address '" + address + "' cannot be listened on: " + why);
  }
  listening_.push_back(fd);
  loop_.watch(fd, [this, fd, accepted = std::move(accepted)] {
    const int connection = accept4(fd, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (connection >= 0) accepted(std::make_unique<SocketWire>(loop_, connection));
  });
}

}  // namespace berth
