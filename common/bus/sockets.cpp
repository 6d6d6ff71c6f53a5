// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/sockets.h"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <thread>
#include <utility>

#include "common/core/error.h"

namespace berth {
namespace {

struct HostAndPort {
  std::string host;
  std::string port;
};

InputError complaint(const std::string& address, const std::string& what) {
  return InputError("address '" + address + "': " + what +
                    ", expected host:port such as 127.0.0.1:502");
}

HostAndPort split(const std::string& address) {
  const auto colon = address.rfind(':');
  if (colon == std::string::npos) throw complaint(address, "has no port");
  return {address.substr(0, colon), address.substr(colon + 1)};
}

/// flags: AI_NUMERICHOST sends no query.
Sockets::Found resolve(const std::string& host, const std::string& port, int flags) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = flags;
  addrinfo* found = nullptr;
  const int error = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  if (error != 0) return {std::nullopt, gai_strerror(error)};
  sockaddr_in result{};
  std::copy_n(reinterpret_cast<const char*>(found->ai_addr), sizeof result,
              reinterpret_cast<char*>(&result));
  freeaddrinfo(found);
  return {result, ""};
}

std::optional<std::size_t> taken(ssize_t size) {
  if (size >= 0) return static_cast<std::size_t>(size);
  const bool later = errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
  return later ? std::optional<std::size_t>(0) : std::nullopt;
}

/// Small frames leave at once.
Socket undelayed(int fd) {
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return Socket(fd);
}

int stream_socket() {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "socket");
  return fd;
}

}  // namespace

Socket::~Socket() {
  if (fd_ >= 0) close(fd_);
}

std::optional<std::size_t> Socket::read(std::span<std::uint8_t> into) const {
  const ssize_t size = recv(fd_, into.data(), into.size(), MSG_DONTWAIT);
  return size == 0 ? std::nullopt : taken(size);
}

std::optional<std::size_t> Socket::write(std::span<const std::uint8_t> bytes) const {
  return taken(send(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL));
}

/// One call of dial, until it has called back.
struct Sockets::Dialling {
  std::string address;
  Ready connected;  // empty: it has
  Loop::TimerId timer = 0;
  int fd = -1;
};

Sockets::Sockets(ProcessLoop& loop, LookUp look_up) : loop_(loop), look_up_(std::move(look_up)) {
  link_->sockets = this;
}

Sockets::~Sockets() {
  {
    const std::lock_guard lock(link_->mutex);
    link_->sockets = nullptr;
  }
  for (const int fd : listening_) {
    loop_.unwatch(fd);
    close(fd);
  }
}

Sockets::Found Sockets::resolve_by_system(const std::string& host, const std::string& port) {
  return resolve(host, port, 0);
}

void Sockets::dial(const std::string& address, Ready connected, Utime timeout) {
  const auto [host, port] = split(address);
  const auto dialling = std::make_shared<Dialling>();
  dialling->address = address;
  dialling->connected = std::move(connected);
  dialling->timer = loop_.after(timeout, [this, dialling, timeout] {
    end(*dialling, Socket(), "no answer within " + std::to_string(timeout / millisecond) + " ms");
  });
  const Found numeric = resolve(host, port, AI_NUMERICHOST);
  if (numeric.address) return connect(dialling, numeric);
  look_up(dialling, host, port);
}

void Sockets::look_up(const std::shared_ptr<Dialling>& dialling, const std::string& host,
                      const std::string& port) {
  const std::string& address = dialling->address;
  auto& waiting = looked_up_[address];
  waiting.push_back(dialling);
  if (waiting.size() > 1) return;  // the query is under way
  std::thread([link = link_, resolver = look_up_, address, host = host, port = port] {
    const Found found = resolver(host, port);
    const std::lock_guard lock(link->mutex);
    if (link->sockets == nullptr) return;
    link->sockets->loop_.post([link, address, found] {
      if (link->sockets == nullptr) return;
      for (const auto& one : std::exchange(link->sockets->looked_up_[address], {})) {
        link->sockets->connect(one, found);
      }
    });
  }).detach();
}

void Sockets::connect(const std::shared_ptr<Dialling>& dialling, const Found& found) {
  if (!dialling->connected) return;  // too late
  if (!found.address) return end(*dialling, Socket(), "its name: " + found.error);
  dialling->fd = stream_socket();
  const auto* to = reinterpret_cast<const sockaddr*>(&*found.address);
  if (::connect(dialling->fd, to, sizeof *found.address) != 0 && errno != EINPROGRESS) {
    // Through the loop, so that a caller is never called back from inside its own call.
    loop_.at(loop_.now(), [this, dialling] { end(*dialling, Socket(), ""); });
    return;
  }
  loop_.watch_writable(dialling->fd, [this, dialling] {
    const int fd = dialling->fd;
    loop_.unwatch(fd);
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    if (error != 0) return end(*dialling, Socket(), "");
    dialling->fd = -1;
    end(*dialling, undelayed(fd), "");
  });
}

void Sockets::end(Dialling& dialling, Socket socket, const std::string& trouble) {
  const Ready connected = std::exchange(dialling.connected, nullptr);
  if (!connected) return;
  loop_.cancel(dialling.timer);
  troubles_[dialling.address] = trouble;
  if (dialling.fd >= 0) {
    loop_.unwatch(dialling.fd);
    close(std::exchange(dialling.fd, -1));
  }
  connected(std::move(socket));
}

std::string Sockets::trouble(const std::string& address) const {
  const auto found = troubles_.find(address);
  return found == troubles_.end() || found->second.empty() ? "" : address + ": " + found->second;
}

void Sockets::listen(const std::string& address, Ready accepted) {
  const auto [host, port] = split(address);
  const Found found = resolve(host, port, 0);  // before other threads run: this may block
  if (!found.address) throw complaint(address, found.error);
  const sockaddr_in at = *found.address;
  const int fd = stream_socket();
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
    if (connection >= 0) accepted(undelayed(connection));
  });
}

}  // namespace berth
