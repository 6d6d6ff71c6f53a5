// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/bus/sockets.h"
#include "drivers/registers/words.h"

namespace berth {

/// One access to a device's registers or bits, which count from 1: register n is address n - 1 of
/// the Modbus protocol.
struct RegisterRequest {
  enum class Kind { read_registers, read_coils, read_inputs, write_registers, write_coil };
  Kind kind = Kind::read_registers;
  int first = 1;
  int count = 1;
  std::vector<Word> words{};  ///< of write_registers: count of them
  bool on = false;            ///< of write_coil
};

/// The outcome of one request.
struct RegisterAnswer {
  std::string error{};  ///< empty: the device has carried it out
  int exception = 0;    ///< the Modbus exception code, where that is the error
  std::vector<Word> words{};
  std::vector<std::uint8_t> bits{};  ///< 0 or 1 each
  Utime sent = 0;                    ///< before the first byte of the request
  Utime received = 0;                ///< behind the last one of the answer

  bool ok() const { return error.empty(); }
  /// Sets error and exception.
  void refuse(int exception_code);
};

/// A driver's connection to a device with registers: ModbusTcpLink in a process, MemoryLink in the
/// twin. No call blocks: requests go out one at a time, answers come through the loop. It keeps its
/// connection up by itself: after a time-out or an unusable answer it closes it, so that no late
/// answer is mistaken for another's, and dials again with back-off.
class RegisterLink {
 public:
  struct Options {
    std::string address;  ///< host:port
    /// Of Modbus' header. 255 (or 0) addresses the device itself, behind no gateway.
    int unit = 1;
    Utime timeout = 50 * millisecond;            ///< of an answer, from the request on
    Utime dial_timeout = Sockets::dial_timeout;  ///< of a connection
    Utime min_backoff = 100 * millisecond;
    Utime max_backoff = 2 * second;
  };
  enum class Urgency { normal, first };  ///< first: ahead of all that wait
  using Done = std::function<void(const RegisterAnswer&)>;
  using ConnectionChanged = std::function<void(bool connected, const std::string& reason)>;

  virtual ~RegisterLink();
  RegisterLink(const RegisterLink&) = delete;
  RegisterLink& operator=(const RegisterLink&) = delete;

  bool connected() const { return connected_; }
  /// No request is under way or waiting.
  bool idle() const { return waiting_.empty() && !current_; }

  /// Each calls done exactly once, unless the link is destroyed before. Not connected, or more than
  /// Modbus carries in one request (125 registers read, 123 written, 2000 bits): at once.
  void read_registers(int first, int count, Done done, Urgency urgency = Urgency::normal);
  void read_coils(int first, int count, Done done, Urgency urgency = Urgency::normal);
  void read_inputs(int first, int count, Done done, Urgency urgency = Urgency::normal);
  void write_registers(int first, std::span<const Word> words, Done done,
                       Urgency urgency = Urgency::normal);
  void write_coil(int coil, bool on, Done done, Urgency urgency = Urgency::normal);

 protected:
  RegisterLink(Loop& loop, Options options, ConnectionChanged changed);

  // The carrier's part, on the loop.
  /// Is followed by dialled(). The constructor of a carrier calls it.
  virtual void dial() = 0;
  /// Is followed by answered() or lost(), unless close() comes before. One request at a time.
  virtual void send(const RegisterRequest& request) = 0;
  virtual void close() = 0;

  /// trouble: why repeated dialling is in vain; empty: it is not.
  void dialled(bool connected, const std::string& trouble);
  void answered(const RegisterAnswer& answer);
  void lost(const std::string& reason);

  Loop& loop() { return loop_; }
  const Options& options() const { return options_; }
  std::string late() const;  ///< the error of an answer that has not come in time

 private:
  struct Pending {
    RegisterRequest request;
    Done done;
  };

  void submit(Pending pending, Urgency urgency);
  void send_next();
  void dial_later();

  Loop& loop_;
  Options options_;
  ConnectionChanged changed_;
  bool connected_ = false;
  Utime backoff_;
  std::string trouble_;  // in dialling, as reported
  std::deque<Pending> waiting_;
  std::optional<Pending> current_;  // under way
  Loop::TimerId dial_timer_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

/// The carrier that fits the loop. changed is called from the loop only, never from in here.
std::unique_ptr<RegisterLink> make_register_link(Loop& loop, RegisterLink::Options options,
                                                 RegisterLink::ConnectionChanged changed);

}  // namespace berth
