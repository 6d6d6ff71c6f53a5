// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/clock_map.h"
#include "common/core/lidar_profile.h"
#include "drivers/devices.h"
#include "drivers/lidar/protocol.h"

namespace berth::lidar {

/// A scanning LIDAR as the driver's node uses it: a device, a recording, or a folder of exports.
/// Driven by a loop; never blocks.
class Adapter {
 public:
  struct Events {
    std::function<void()> ready;
    /// ScanAnswer, Returns, ScanEnd and Status, only while ready.
    std::function<void(const Message&)> message;
    /// No longer ready, or not ready for a new reason. It retries by itself where that can help.
    std::function<void(const std::string& reason)> lost;
    /// An error that ends neither the connection nor a scan.
    std::function<void(const std::string& what)> trouble{};
  };

  virtual ~Adapter() = default;

  /// Call once, first.
  virtual void start(Events events) = 0;
  virtual bool ready() const = 0;
  /// Why it is not ready.
  virtual const std::string& reason() const = 0;
  /// For messages: "127.0.0.1:15024".
  virtual const std::string& name() const = 0;
  /// Known once ready.
  virtual const Identity& identity() const = 0;
  /// The present map from the loop's clock to the device's. Known once ready.
  virtual ClockLine clock() const = 0;

  virtual void order(const ScanOrder& order) = 0;
  virtual void cancel(std::int64_t scan_id) = 0;
  /// Gives up the connection: `lost` is called.
  virtual void drop(const std::string& reason) = 0;
};

/// The adapter that a device's configuration names. @throws InputError when there is nothing to
/// play back.
std::unique_ptr<Adapter> make_adapter(const LidarDevice& device, const LidarProfile& profile,
                                      Loop& loop);

}  // namespace berth::lidar
