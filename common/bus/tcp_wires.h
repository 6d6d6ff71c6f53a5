// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <netinet/in.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/process_loop.h"
#include "common/bus/wire.h"

namespace berth {

/// A socket's descriptor, closed with its holder.
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

 private:
  int fd_;
};

/// Real TCP sockets on a ProcessLoop, which must outlive them and their wires. Names are looked up
/// on a thread of their own, each once at a time: the system's resolver may take half a minute.
class TcpWires final : public Wires {
 public:
  struct Found {
    std::optional<sockaddr_in> address;
    std::string error;  ///< when there is none
  };
  /// Asked on a thread of its own; it may block.
  using LookUp = std::function<Found(const std::string& host, const std::string& port)>;
  using Ready = std::function<void(Socket)>;

  explicit TcpWires(ProcessLoop& loop, LookUp look_up = ask_system);
  ~TcpWires() override;
  TcpWires(const TcpWires&) = delete;
  TcpWires& operator=(const TcpWires&) = delete;

  void dial(const std::string& address, Connected connected,
            std::int64_t timeout = dial_timeout) override;
  std::string trouble(const std::string& address) const override;
  void listen(const std::string& address, Connected accepted) override;
  /// The same for whoever has its own use of the socket, which does not block (O_NONBLOCK).
  void dial_socket(const std::string& address, Ready connected,
                   std::int64_t timeout = dial_timeout);
  void listen_socket(const std::string& address, Ready accepted);

 private:
  struct Dialling;
  /// Through which a thread finds the wires, as long as they are there.
  struct Link {
    std::mutex mutex;
    TcpWires* wires = nullptr;
  };

  static Found ask_system(const std::string& host, const std::string& port);
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
