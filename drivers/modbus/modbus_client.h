// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/bus/wire.h"
#include "drivers/modbus/frames.h"
#include "drivers/modbus/words.h"

namespace berth {

/// What came of one request. Views are valid during the callback.
struct ModbusAnswer {
  std::string error;                   ///< empty: the device did what was asked
  int exception = 0;                   ///< Modbus exception code, when that is the error
  std::span<const Word> words;         ///< of a register read
  std::span<const std::uint8_t> bits;  ///< of a bit read, 0 or 1 each
  Utime sent = 0;
  Utime received = 0;

  bool ok() const { return error.empty(); }
};

/// A Modbus TCP client that never waits: requests go out one at a time, answers come back through
/// the loop. It keeps its connection up by itself: after a time-out, a damaged or a foreign answer
/// it closes it, so that no late answer is ever taken for another's, and dials again with back-off.
/// Registers and coils count from 1 (register n is PDU address n - 1).
class ModbusClient {
 public:
  struct Options {
    std::string address;  ///< host:port
    int unit = 1;
    Utime timeout = 50 * millisecond;          ///< of an answer
    Utime dial_timeout = Wires::dial_timeout;  ///< of a connection
    Utime backoff_least = 100 * millisecond;
    Utime backoff_most = 2 * second;
  };
  enum class Urgency { normal, first };  ///< first: ahead of all that wait
  using Done = std::function<void(const ModbusAnswer&)>;
  using ConnectionChanged = std::function<void(bool connected, const std::string& reason)>;

  ModbusClient(Loop& loop, Options options, ConnectionChanged changed);
  ~ModbusClient();
  ModbusClient(const ModbusClient&) = delete;
  ModbusClient& operator=(const ModbusClient&) = delete;

  bool connected() const { return wire_ != nullptr; }
  /// Nothing under way and nothing waiting.
  bool idle() const { return waiting_.empty() && !current_; }

  /// Each calls done exactly once, unless the client is destroyed before. Not connected: at once.
  void read_registers(int first, int count, Done done, Urgency urgency = Urgency::normal);
  void read_coils(int first, int count, Done done, Urgency urgency = Urgency::normal);
  void read_inputs(int first, int count, Done done, Urgency urgency = Urgency::normal);
  void write_registers(int first, std::span<const Word> words, Done done,
                       Urgency urgency = Urgency::normal);
  void write_coil(int coil, bool on, Done done, Urgency urgency = Urgency::normal);

  /// Closes and dials again.
  void reconnect(const std::string& reason);

 private:
  struct Request {
    ModbusFrame frame;
    int count = 0;  // of items asked for
    Done done;
  };

  void read(int function, int first, int count, Done done, Urgency urgency);
  void submit(Request request, Urgency urgency);
  void send_next();
  void dial();
  void on_dialled(std::unique_ptr<Wire> wire);
  void on_readable();
  void on_timeout();
  void on_frame(std::span<const std::uint8_t> frame);
  /// Empty, or what is wrong with the frame as an answer to the request under way.
  std::string check(std::span<const std::uint8_t> frame);

  Loop& loop_;
  Options options_;
  ConnectionChanged changed_;
  ModbusFrames frames_;
  std::unique_ptr<Wire> wire_;  // null: not connected
  std::uint16_t transaction_ = 0;
  Utime backoff_;
  std::string trouble_;  // in dialling, as told
  std::deque<Request> waiting_;
  std::optional<Request> current_;  // under way
  Utime sent_ = 0;
  Loop::TimerId timeout_timer_ = 0;
  Loop::TimerId dial_timer_ = 0;
  std::vector<Word> words_;
  std::vector<std::uint8_t> bits_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth
