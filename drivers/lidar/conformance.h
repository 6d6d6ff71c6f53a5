// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

namespace berth::lidar {

/// One requirement of PROTOCOL.md on a device, and whether the device meets it.
struct ConformanceCheck {
  enum class Outcome { ok, failed, skipped };
  std::string name;
  Outcome outcome = Outcome::ok;
  std::string found;  ///< observation, with figures
  std::string mend;   ///< of failed: remedy
};

/// Tests a device or bridge at host:port with valid and invalid messages, over several connections
/// and some ten seconds. The device makes scans. No other host may be connected. Reports each check
/// once it is done.
/// @return whether none has failed.
/// @throws InputError when the address is not of the form host:port, or no server listens there.
bool test_conformance(const std::string& address,
                      const std::function<void(const ConformanceCheck&)>& report);

}  // namespace berth::lidar
