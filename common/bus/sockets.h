// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/process_loop.h"

namespace berth {

/// A socket's descriptor, closed with its holder. No call blocks.
class Socket {
 public:
  explicit Socket(int fd = -1) : fd_(fd) {}
  Socket(Socket&& other) noexcept : fd_(other.release()) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Socket();
  int fd() const { return fd_; }  ///< -1: none
  int release() { return std::exchange(fd_, -1); }
  /// @return number of bytes read, 0 when there are none now; nothing when the peer is gone and all
  /// its bytes have been read.
  std::optional<std::size_t> read(std::span<std::uint8_t> into) const;
  /// @return number of bytes written, fewer when the peer does not read; nothing when it is gone.
  std::optional<std::size_t> write(std::span<const std::uint8_t> bytes) const;

 private:
  int fd_;
};

/// TCP connections to devices and from hosts, on a ProcessLoop, which must outlive this. Addresses
/// are "host:port". Names are resolved on a thread of their own, each once at a time: the system's
/// resolver may take half a minute. Called from the loop only.
class Sockets {
 public:
  struct Found {
    std::optional<sockaddr_in> address;
    std::string error;  ///< when there is none
  };
  /// Resolver; called on a thread of its own, so that it may block.
  using LookUp = std::function<Found(const std::string& host, const std::string& port)>;
  /// The socket does not block (O_NONBLOCK).
  using Ready = std::function<void(Socket)>;
  /// How long TCP waits for the answer to its first packet (RFC 6298, 2.1). Dialling again sends
  /// the next one.
  static constexpr Utime dial_timeout = 1 * second;

  explicit Sockets(ProcessLoop& loop, LookUp look_up = resolve_by_system);
  ~Sockets();
  Sockets(const Sockets&) = delete;
  Sockets& operator=(const Sockets&) = delete;

  /// Resolves the name and connects, without blocking; calls back with the socket, or with none
  /// where no server listens or none has answered within the time-out.
  /// @throws InputError when the address is not of the form host:port.
  void dial(const std::string& address, Ready connected, Utime timeout = dial_timeout);
  /// Why repeated dialling is in vain: the name is unknown, or no host answered in time. As of the
  /// last attempt; empty: no such reason.
  std::string trouble(const std::string& address) const;
  /// Accepts connections until this ends.
  /// @throws InputError when the address cannot be listened on.
  void listen(const std::string& address, Ready accepted);

 private:
  struct Dialling;
  /// Gives a resolver's thread access to the sockets while they exist.
  struct Link {
    std::mutex mutex;
    Sockets* sockets = nullptr;
  };

  static Found resolve_by_system(const std::string& host, const std::string& port);
  void look_up(const std::shared_ptr<Dialling>& dialling, const std::string& host,
               const std::string& port);
  void connect(const std::shared_ptr<Dialling>& dialling, const Found& found);
  void end(Dialling& dialling, Socket socket, const std::string& trouble);

  ProcessLoop& loop_;
  LookUp look_up_;
  std::shared_ptr<Link> link_ = std::make_shared<Link>();
  std::map<std::string, std::vector<std::shared_ptr<Dialling>>> looked_up_;  // by address
  std::map<std::string, std::string> troubles_;                              // by address
  std::vector<int> listening_;
};

}  // namespace berth
