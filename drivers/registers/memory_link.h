// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/registers/register_link.h"
#include "drivers/registers/register_server.h"

namespace berth {

class SimulatedLoop;
class MemoryLink;
class MemoryServer;

/// One connection in the twin. An end is null once it is closed, which the other end notices later;
/// the server's end is also null before it has accepted.
struct MemoryConnection {
  MemoryLink* link = nullptr;
  MemoryServer* server = nullptr;
  Loop& link_loop;
  Loop& server_loop;
  Utime latency;  ///< of each way, us
  int unit;
  RegisterServer::ConnectionState state{};
};

/// A driver's link to a MemoryServer of the same Simulation: requests as values, each way after the
/// simulation's wire latency.
class MemoryLink final : public RegisterLink {
 public:
  MemoryLink(SimulatedLoop& loop, Options options, ConnectionChanged changed);
  ~MemoryLink() override;

 private:
  friend class MemoryServer;
  void dial() override;
  void send(const RegisterRequest& request) override;
  void close() override;
  void on_answer(RegisterAnswer answer);

  SimulatedLoop& twin_;
  std::shared_ptr<MemoryConnection> connection_;
  Utime sent_ = 0;
  Loop::TimerId timeout_timer_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

class MemoryServer final : public RegisterServer {
 public:
  /// @throws InputError when the address is served already.
  MemoryServer(SimulatedLoop& loop, Options options, RegisterImage& image, Hook before_read,
               Hook after_write);
  ~MemoryServer() override;

  int connections() const override { return static_cast<int>(connections_.size()); }
  void drop_connection(int n) override;

 private:
  friend class MemoryLink;
  ConnectionState& state(int n) override {
    return connections_.at(static_cast<std::size_t>(n))->state;
  }
  void accept(const std::shared_ptr<MemoryConnection>& connection);
  void take(const std::shared_ptr<MemoryConnection>& from, const RegisterRequest& request);
  void answer(const std::shared_ptr<MemoryConnection>& to, const RegisterRequest& request);
  void carry_out(const RegisterRequest& request, RegisterTable table, RegisterAnswer& answer);
  void drop(const std::shared_ptr<MemoryConnection>& connection);

  SimulatedLoop& loop_;
  std::vector<std::shared_ptr<MemoryConnection>> connections_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth
