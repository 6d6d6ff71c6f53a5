// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "testbed/arm_pair.h"

namespace berth::testbed {

/// The second layer of safety, above the PLC's and the controllers' own: judges from what the
/// testbed hears whether the arms may move. Times are on the node's clock, us.
class SafetySupervisor {
 public:
  struct Settings {
    std::int64_t arm_silence = 150000;        ///< without a valid ARM_STATE
    std::int64_t heartbeat_silence = 150000;  ///< of a watched node
    std::int64_t facility_silence = 1000000;  ///< without a valid FACILITY_STATE
    std::vector<std::string> watched_nodes;   ///< whose heartbeats must come
    double largest_lag = 0.05;                ///< rad or m, reported joint from the commanded one
  };
  /// Controller states as in arm_state_t.
  enum class ArmState { offline, idle, running, held, fault, estop };
  struct ArmReport {
    std::int64_t received = 0;
    bool valid = false;
    ArmState state = ArmState::offline;
    std::string reason;
  };

  /// In rising order of what it takes to go on.
  enum class Level {
    good,
    not_ready,  ///< not everybody has been heard yet
    hold,       ///< somebody is silent: stop on the path, go on by itself when he is back
    held,       ///< arms are stopped; a person has to say RESUME
    fault       ///< E-stop, fence, controller: to be put right first
  };
  struct Verdict {
    Level level = Level::good;
    std::string code;    ///< stable name, for events
    std::string reason;  ///< for the operator
  };

  explicit SafetySupervisor(Settings settings);

  void on_arm(ArmRole role, const ArmReport& report);
  void on_heartbeat(const std::string& node, std::int64_t received);
  void on_facility(std::int64_t received, bool valid, bool estop_closed, bool fence_closed,
                   bool motion_enabled, const std::string& reason);
  /// Reported joints against what was commanded a dead time before. @return empty, or which strays.
  std::string lag(ArmRole role, const ArmKinematics& arm, const Joints& reported,
                  const Joints& commanded) const;

  /// engaged: the arms follow set-points, so a controller that does not run is a fault.
  Verdict judge(std::int64_t now, bool engaged) const;
  const std::optional<ArmReport>& arm(ArmRole role) const {
    return role == ArmRole::replica ? replica_ : sensor_;
  }

 private:
  Settings settings_;
  std::optional<ArmReport> replica_;
  std::optional<ArmReport> sensor_;
  struct Facility {
    std::int64_t received = 0;
    bool estop_closed = false;
    bool fence_closed = false;
    bool motion_enabled = false;
  };
  std::optional<Facility> facility_;
  std::string facility_reason_ = "the facility has not been heard yet";
  std::map<std::string, std::int64_t> heartbeats_;
};

}  // namespace berth::testbed
