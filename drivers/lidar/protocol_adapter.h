// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <string>

#include "common/bus/sockets.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/connection.h"

namespace berth::lidar {

struct ProtocolSettings {
  std::string address;                      ///< host:port
  std::string model;                        ///< the device must name itself so
  Utime status_period = 250 * millisecond;  ///< of clock readings
  Utime silence = 1 * second;               ///< after which a device counts as dead
  Utime redial = 500 * millisecond;
  Utime dial_timeout = Sockets::dial_timeout;
  Utime returns_silence = 1 * second;  ///< a scan without news for so long: the same
};

/// The host's end of Berth's own protocol (PROTOCOL.md), over TCP in a process and as values in the
/// twin: dials until connected, greets, checks the device's identity, reads its clock, detects
/// silence. Ready once the device is known and its clock read. A device that hangs up on a greeting
/// in the newest version is greeted in version 1.
class ProtocolAdapter final : public Adapter {
 public:
  ProtocolAdapter(ProtocolSettings settings, Loop& loop);
  ~ProtocolAdapter() override;
  ProtocolAdapter(const ProtocolAdapter&) = delete;
  ProtocolAdapter& operator=(const ProtocolAdapter&) = delete;

  void start(Events events) override;
  bool ready() const override { return ready_; }
  const std::string& reason() const override { return reason_; }
  const std::string& name() const override { return settings_.address; }
  const Identity& identity() const override { return identity_; }
  ClockLine clock() const override { return clock_.line(); }
  void order(const ScanOrder& order) override;
  void cancel(std::int64_t scan_id) override { send(Cancel{scan_id}); }
  /// Closes the connection and dials anew.
  void drop(const std::string& reason) override;

 private:
  void hung_up(const std::string& reason);
  void send(const Message& message);
  void dial();
  void connected(std::unique_ptr<Connection> connection, const std::string& trouble);
  void receive(const Message& message);
  void greet(const Identity& identity);
  void read_clock(const Status& status);
  void follow_scan(const Message& message);
  void poll();

  ProtocolSettings settings_;
  Loop& loop_;
  Events events_;
  std::unique_ptr<Connection> connection_;
  Identity identity_;
  std::uint16_t version_ = protocol_version;  // of the greeting
  bool greeted_ = false;
  bool ready_ = false;
  std::string reason_;
  ClockMap clock_;
  std::uint32_t token_ = 0;
  std::map<std::uint32_t, Utime> queries_;  // token: when it was sent
  Utime last_received_ = 0;
  bool scanning_ = false;
  Utime scan_news_ = 0;  // when the last message about a scan came
  Loop::TimerId poll_timer_ = 0;
  Loop::TimerId redial_timer_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth::lidar
