// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "drivers/registers/words.h"

namespace berth {

enum class RegisterTable { registers, coils, inputs };

/// The registers and bits that a device shows. Numbers count from 1.
class RegisterImage {
 public:
  RegisterImage(int registers, int coils, int inputs)
      : registers_(static_cast<std::size_t>(registers)),
        coils_(static_cast<std::size_t>(coils)),
        inputs_(static_cast<std::size_t>(inputs)) {}

  Word& holding(int n) { return registers_[index(n)]; }
  std::span<Word> holding(int first, int count) {
    return std::span(registers_).subspan(index(first), static_cast<std::size_t>(count));
  }
  bool coil(int n) const { return coils_[index(n)] != 0; }
  void set_coil(int n, bool on) { coils_[index(n)] = on ? 1 : 0; }
  bool input(int n) const { return inputs_[index(n)] != 0; }
  void set_input(int n, bool on) { inputs_[index(n)] = on ? 1 : 0; }

  /// Of libmodbus' server, into this memory.
  Word* registers() { return registers_.data(); }
  std::uint8_t* coils() { return coils_.data(); }
  std::uint8_t* inputs() { return inputs_.data(); }

  bool holds(RegisterTable table, int first, int count) const {
    return first >= 1 && count >= 1 && count <= size(table) - first + 1;
  }
  int size(RegisterTable table) const {
    const std::size_t size = table == RegisterTable::registers ? registers_.size()
                             : table == RegisterTable::coils   ? coils_.size()
                                                               : inputs_.size();
    return static_cast<int>(size);
  }

 private:
  static std::size_t index(int n) { return static_cast<std::size_t>(n - 1); }

  std::vector<Word> registers_;
  std::vector<std::uint8_t> coils_;
  std::vector<std::uint8_t> inputs_;
};

/// Faults of a simulated device's connections; each lasts until it is cleared.
struct RegisterFaults {
  bool silent = false;   ///< takes requests, carries out and answers none
  int exception = 0;     ///< carries out nothing, answers with this exception code
  bool garbage = false;  ///< carries out nothing, answers with bytes that are no Modbus
  Utime delay = 0;       ///< carries out and answers so much later
};

/// Serves a simulated device's image: ModbusTcpServer in a process, MemoryServer in the twin. It
/// answers to its unit and, as a device behind no gateway, to 0 and 255 (MODBUS Messaging on TCP/IP
/// Implementation Guide V1.0b, 4.4.2); others are answered by exception 11. Connections beyond the
/// limit are closed at once, silent ones after a while.
class RegisterServer {
 public:
  struct Options {
    std::string address;  ///< host:port
    int unit = 1;
    int connections = 2;
    Utime idle_timeout = 5 * second;
  };
  /// Called on the loop with first number (from 1) and count of a request: before a read, to update
  /// the image, and after a write.
  using Hook = std::function<void(RegisterTable table, int first, int count)>;

  /// The server's state of one connection.
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
  /// the peer is not informed; it counts until it has been idle too long. New connections work.
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
