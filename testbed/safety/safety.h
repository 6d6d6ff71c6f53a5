// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

/// The second layer of safety, above the PLC's and the controllers' own: decides from the received
/// messages whether the arms may move. Times are on the node's clock, us.
class SafetySupervisor {
 public:
  struct Settings {
    std::int64_t arm_silence = 150000;                ///< without a valid ARM_STATE
    std::int64_t heartbeat_silence = 150000;          ///< of a watched node
    std::int64_t facility_silence = 250000;           ///< without a FACILITY_STATE
    std::int64_t scan_silence = 200000;               ///< of a running scan, from packet to packet
    std::vector<std::string> watched_nodes;           ///< whose heartbeats must come
    std::vector<std::string> watched_in_closed_loop;  ///< also, while the estimate steers
  };
  /// Controller states as in arm_state_t.
  enum class ArmState { offline, idle, running, held, fault, estop };
  struct ArmReport {
    std::int64_t received = 0;
    bool valid = false;
    ArmState state = ArmState::offline;
    std::string reason;
  };

  /// In rising order of the effort to resume.
  enum class Level {
    good,
    not_ready,  ///< a partner has not reported yet
    hold,       ///< a partner is silent: stop at once, go on when it reports again
    held,       ///< arms are stopped; the operator has to RESUME
    fault       ///< E-stop, fence, controller: must be cleared first
  };
  struct Verdict {
    Level level = Level::good;
    std::string code;    ///< stable name, for events
    std::string reason;  ///< for the operator
  };

  /// State of the arms' motion.
  struct Activity {
    bool engaged = false;  ///< they follow set-points, so a controller that does not run is a fault
    bool closed_loop = false;  ///< the estimate steers
  };

  explicit SafetySupervisor(Settings settings);

  void on_arm(ArmRole role, const ArmReport& report);
  void on_heartbeat(const std::string& node, std::int64_t received);
  void on_facility(std::int64_t received, bool valid, bool estop_closed, bool fence_closed,
                   bool motion_enabled, const std::string& reason);
  /// A scan was requested, or a packet of one came. more: of the same scan should follow.
  void on_scan(std::int64_t received, bool more);
  /// fault: why the LIDAR cannot scan; empty: it can.
  void on_lidar(const std::string& fault) { lidar_fault_ = fault; }

  /// fault: why the node is in FAULT; empty: it is not.
  void on_node(const std::string& node, const std::string& fault) { node_faults_[node] = fault; }

  Verdict judge(std::int64_t now, const Activity& activity) const;
  /// Fault that a controller's reset does not clear: an emergency stop, the fence. Empty: none.
  std::string unresettable_fault() const;
  const std::optional<ArmReport>& arm(ArmRole role) const {
    return role == ArmRole::replica ? replica_ : sensor_;
  }

 private:
  std::optional<Verdict> judge_manual_faults() const;
  std::optional<Verdict> judge_chain() const;
  std::optional<Verdict> judge_arms(std::int64_t now, bool engaged) const;
  std::optional<Verdict> judge_facility(std::int64_t now) const;
  std::optional<Verdict> judge_nodes(std::int64_t now, const std::vector<std::string>& nodes) const;
  std::optional<Verdict> judge_sensor(std::int64_t now) const;
  std::optional<Verdict> judge_node_faults() const;

  Settings settings_;
  std::optional<ArmReport> replica_;
  std::optional<ArmReport> sensor_;
  struct Facility {
    std::int64_t received = 0;
    bool valid = false;
    bool estop_closed = false;
    bool fence_closed = false;
    bool motion_enabled = false;
  };
  std::optional<Facility> facility_;
  std::string facility_reason_ = "the facility has not reported yet";
  std::map<std::string, std::int64_t> heartbeats_;
  std::map<std::string, std::string> node_faults_;
  std::string lidar_fault_;
  std::int64_t scan_received_ = 0;
  std::int64_t scan_interval_ = 0;  // between the last two packets of a scan
  bool scan_running_ = false;
};

}  // namespace berth::testbed
