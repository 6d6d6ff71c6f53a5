// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "common/bus/loop.h"
#include "drivers/lidar/clock_map.h"
#include "drivers/lidar/connection.h"

namespace berth::lidar {

struct LinkSettings {
  std::string address;                      ///< host:port
  std::string model;                        ///< the device must name itself so
  Utime status_period = 250 * millisecond;  ///< of clock readings
  Utime silence = 1 * second;               ///< after which a device is taken for dead
  Utime redial = 500 * millisecond;
};

/// The host's end of the protocol: dials, again and again; greets; checks who answers; reads the
/// device's clock; notices silence. Ready once the device is known and its clock read.
class LidarLink {
 public:
  struct Events {
    std::function<void()> ready;
    /// ScanAnswer, Returns, ScanEnd and Status, only while ready.
    std::function<void(const Message&)> message;
    /// The link was ready, or a dial failed for a new reason; it goes on dialling by itself.
    std::function<void(const std::string& reason)> lost;
  };

  LidarLink(LinkSettings settings, Loop& loop, Wires& wires, Events events);
  ~LidarLink();
  LidarLink(const LidarLink&) = delete;
  LidarLink& operator=(const LidarLink&) = delete;

  bool ready() const { return ready_; }
  /// Why not, when not ready.
  const std::string& reason() const { return reason_; }
  void send(const Message& message);
  /// Closes the connection and dials anew; `lost` is called.
  void drop(const std::string& reason);
  const Identity& identity() const { return identity_; }
  const ClockMap& clock() const { return clock_; }

 private:
  void dial();
  void connected(int fd);
  void receive(const Message& message);
  void greet(const Identity& identity);
  void read_clock(const Status& status);
  void poll();

  LinkSettings settings_;
  Loop& loop_;
  Wires& wires_;
  Events events_;
  std::unique_ptr<Connection> connection_;
  Identity identity_;
  bool greeted_ = false;
  bool ready_ = false;
  std::string reason_;
  ClockMap clock_;
  std::uint32_t token_ = 0;
  std::map<std::uint32_t, Utime> queries_;  // token: when it was sent
  Utime heard_ = 0;
  Loop::TimerId poll_timer_ = 0;
  Loop::TimerId redial_timer_ = 0;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth::lidar
