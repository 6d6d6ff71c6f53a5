// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/bus/wire.h"
#include "drivers/modbus/frames.h"
#include "drivers/modbus/modbus_image.h"

namespace berth {

/// What is wrong with a simulated server; each lasts until it is taken back.
struct ModbusFaults {
  bool silent = false;   ///< takes requests, carries out and answers none
  int exception = 0;     ///< carries out nothing, answers with this exception code
  bool garbage = false;  ///< carries out nothing, answers with bytes that are no Modbus
  Utime delay = 0;       ///< carries out and answers so much later
};

/// Serves an image over Modbus TCP: functions 1, 2, 3, 5, 6, 15 and 16. Connections beyond the
/// limit are closed at once, silent ones after a while, and those that send anything but Modbus
/// too.
class ModbusServer {
 public:
  struct Options {
    std::string address;  ///< host:port
    int unit = 1;
    int connections = 2;
    Utime idle_timeout = 5 * second;
  };
  /// Called with the first number (from 1) and count of what a request touches.
  using Hook = std::function<void(ModbusTable table, int first, int count)>;

  /// before_read may renew the image; after_write looks at what has been written into it.
  /// @throws InputError when the address cannot be listened on.
  ModbusServer(Loop& loop, Options options, ModbusImage& image, Hook before_read, Hook after_write);
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  int connections() const { return static_cast<int>(connections_.size()); }
  void drop_connections();
  /// One of them, counted from 0 in the order in which they came.
  void drop_connection(std::size_t n);
  /// Present connections go deaf as after a peer's power cut: nothing is heard or said on them, and
  /// nobody is told; they count until they have been idle too long. New ones are as they should be.
  void half_open();
  void half_open(std::size_t n);
  ModbusFaults& faults() { return faults_; }

 private:
  struct Connection {
    std::unique_ptr<Wire> wire;
    std::uint64_t id = 0;
    Utime last_heard = 0;
    ModbusFrames frames;
  };

  void on_accepted(std::unique_ptr<Wire> wire);
  /// Null when it has been closed.
  Connection* connection(std::uint64_t id);
  void on_readable(std::uint64_t id);
  /// @return false when the connection cannot go on.
  bool take(Connection& from, std::span<const std::uint8_t> frame);
  bool answer(Wire& wire, std::span<const std::uint8_t> frame);
  void drop(std::uint64_t id);
  void drop_idle();

  Loop& loop_;
  Options options_;
  ModbusImage& image_;
  Hook before_read_;
  Hook after_write_;
  std::vector<std::unique_ptr<Connection>> connections_;
  std::uint64_t last_id_ = 0;
  ModbusFaults faults_;
  Loop::TimerId idle_timer_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth
