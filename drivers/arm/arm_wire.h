// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "drivers/arm/adapter.h"
#include "drivers/arm/register_map.h"

namespace berth {

/// Translates between registers and SI units: the pendant counts degrees and, for linear axes, mm.
class ArmWire {
 public:
  ArmWire(RegisterMap map, std::array<bool, 6> linear) : map_(std::move(map)), linear_(linear) {}

  const RegisterMap& map() const { return map_; }
  /// words: map().status.count of them. tick_ms: the controller's clock, wrapped; the report has
  /// no time yet.
  ArmReport decode(std::span<const Word> words, int& tick_ms) const;
  /// The whole command block; valid until the next call.
  std::span<const Word> encode(const ArmOrder& order, int host_heartbeat);

 private:
  RegisterMap map_;
  std::array<bool, 6> linear_;
  std::vector<Word> block_;
};

/// Which joints are linear.
std::array<bool, 6> linear_axes(const ArmKinematics& kinematics);

/// Degrees or mm of one joint, and back.
double pendant_from_si(double value, bool linear);
double si_from_pendant(double value, bool linear);

}  // namespace berth
