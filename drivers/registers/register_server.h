// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/bus/loop.h"
#include "drivers/registers/register_image.h"

namespace berth {

/// What is wrong with a simulated device's connections; each lasts until it is taken back.
struct RegisterFaults {
  bool silent = false;   ///< takes requests, carries out and answers none
  int exception = 0;     ///< carries out nothing, answers with this exception code
  bool garbage = false;  ///< carries out nothing, answers with bytes that are no Modbus
  Utime delay = 0;       ///< carries out and answers so much later
};

/// Serves a simulated device's image: ModbusTcpServer in a process, MemoryServer in the twin.
/// It answers to its unit and, as a device behind no gateway, to 0 and 255 (MODBUS Messaging on
/// TCP/IP Implementation Guide V1.0b, 4.4.2); others earn exception 11. Connections beyond the
/// limit are closed at once, silent ones after a while.
class RegisterServer {
 public:
  struct Options {
    std::string address;  ///< host:port
    int unit = 1;
    int connections = 2;
    Utime idle_timeout = 5 * second;
  };
  /// Called on the loop with the first number (from 1) and count of what a request touches:
  /// before a read, which it may renew, or behind a write.
  using Hook = std::function<void(RegisterTable table, int first, int count)>;

  /// Of one connection, as the server has it.
  struct ConnectionState {
    Utime last_received = 0;
    bool deaf = false;
  };

  virtual ~RegisterServer() { loop_.cancel(idle_timer_); }
  RegisterServer(const RegisterServer&) = delete;
  RegisterServer& operator=(const RegisterServer&) = delete;

  virtual int connections() const = 0;
  /// One of them, counted from 0 in the order in which they came.
  virtual void drop_connection(int n) = 0;
  /// The connection goes deaf as after a peer's power cut: nothing is received or sent on it, and
  /// nobody is told; it counts until it has been idle too long. New ones are as they should be.
  void half_open(int n) { state(n).deaf = true; }

  void drop_connections() {
    while (connections() > 0) drop_connection(0);
  }
  void half_open_connections() {
    for (int n = 0; n < connections(); ++n) half_open(n);
  }
  RegisterFaults& faults() { return faults_; }

 protected:
  RegisterServer(Loop& loop, Options options, RegisterImage& image, Hook before_read,
                 Hook after_write)
      : options_(std::move(options)),
        image_(image),
        before_read_(std::move(before_read)),
        after_write_(std::move(after_write)),
        loop_(loop),
        idle_timer_(loop.every(second, [this] { drop_idle(); })) {}

  virtual ConnectionState& state(int n) = 0;
  bool is_addressed_by(int unit) const { return unit == options_.unit || unit == 0 || unit == 255; }

  const Options options_;
  RegisterImage& image_;
  const Hook before_read_;
  const Hook after_write_;
  RegisterFaults faults_;

 private:
  void drop_idle() {
    const Utime limit = loop_.now() - options_.idle_timeout;
    for (int n = 0; n < connections();) {
      state(n).last_received < limit ? drop_connection(n) : void(++n);
    }
  }

  Loop& loop_;
  Loop::TimerId idle_timer_;
};

/// The server that fits the loop. The hooks may be empty.
/// @throws InputError when the address cannot be listened on.
std::unique_ptr<RegisterServer> serve_registers(Loop& loop, RegisterServer::Options options,
                                                RegisterImage& image,
                                                RegisterServer::Hook before_read,
                                                RegisterServer::Hook after_write);

}  // namespace berth
