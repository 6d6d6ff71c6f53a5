// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "common/core/arm_kinematics.h"
#include "drivers/arm/register_map.h"

namespace berth {

/// What a controller says of itself in the register `state`.
enum class ControllerState { idle = 1, running = 2, held = 3, fault = 4, emergency_stop = 5 };

/// The status block of one read.
struct ArmReport {
  bool valid = false;  ///< the controller vouches for the joints
  Joints joints{};     ///< rad, m
  int tick_ms = 0;
  int heartbeat = 0;
  int setpoint_taken = 0;
  int state = 0;  ///< a ControllerState
  int error = 0;
  int program_state = 0;
  double speed_override = 0;  ///< 0..1
  double tcp_speed = 0;       ///< m/s
};

/// The command block of one write.
struct ArmOrder {
  Joints joints{};
  int sequence = 0;     ///< the controller takes the joints when it changes
  bool follow = false;  ///< false: stand
  int heartbeat = 0;
  double speed_limit = 1;  ///< 0..1 of the joints' own
  int time_ms = 0;         ///< at which the joints should be reached, wrapped
};

/// Translates between registers and SI units: the pendant counts degrees and, for linear axes, mm.
class ArmWire {
 public:
  ArmWire(RegisterMap map, std::array<bool, 6> linear) : map_(std::move(map)), linear_(linear) {}

  const RegisterMap& map() const { return map_; }
  /// words: map().status.count of them.
  ArmReport decode(std::span<const Word> words) const;
  /// The whole command block; valid until the next call.
  std::span<const Word> encode(const ArmOrder& order);

 private:
  RegisterMap map_;
  std::array<bool, 6> linear_;
  std::vector<Word> block_;
};

/// Degrees or mm of one joint, and back.
double pendant_from_si(double value, bool linear);
double si_from_pendant(double value, bool linear);

}  // namespace berth
