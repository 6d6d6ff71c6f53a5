// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

namespace berth::lidar {

/// One thing that PROTOCOL.md asks of a device, and whether it does so.
struct ConformanceCheck {
  enum class Outcome { ok, failed, skipped };
  std::string name;
  Outcome outcome = Outcome::ok;
  std::string found;  ///< what was seen, with figures
  std::string mend;   ///< of failed: what the device must do instead
};

/// Speaks to a device or bridge at host:port as the driver does, and as no driver should, over
/// several connections and some ten seconds: it makes scans. No other host may be connected.
/// Reports each check once it is done.
/// @return whether none has failed.
/// @throws InputError when the address is not of the form host:port, or no server listens there.
bool test_conformance(const std::string& address,
                      const std::function<void(const ConformanceCheck&)>& report);

}  // namespace berth::lidar
