// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety/safety.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "testbed/motion/arm_pair.h"

namespace berth::testbed {
namespace {

std::string milliseconds(std::int64_t us) {
  return fixed(static_cast<double>(us) * 1e-3, 0) + " ms";
}

}  // namespace

SafetySupervisor::SafetySupervisor(Settings settings) : settings_(std::move(settings)) {}

void SafetySupervisor::on_arm(ArmRole role, const ArmReport& report) {
  std::optional<ArmReport>& last = role == ArmRole::replica ? replica_ : sensor_;
  const std::int64_t last_valid = last ? last->received : 0;
  last = report;
  // silence counts from the last valid joints
  if (!report.valid) last->received = last_valid;
}

void SafetySupervisor::on_heartbeat(const std::string& node, std::int64_t received) {
  heartbeats_[node] = received;
}

void SafetySupervisor::on_facility(std::int64_t received, bool valid, bool estop_closed,
                                   bool fence_closed, bool motion_enabled,
                                   const std::string& reason) {
  if (!valid) {
    facility_reason_ = reason.empty() ? "the PLC does not answer" : "the PLC: " + reason;
    if (facility_) facility_->valid = false;
    return;
  }
  facility_ = Facility{received, true, estop_closed, fence_closed, motion_enabled};
}

void SafetySupervisor::on_scan(std::int64_t received, bool more) {
  if (scan_running_) scan_interval_ = received - scan_received_;
  scan_received_ = received;
  scan_running_ = more;
}

SafetySupervisor::Verdict SafetySupervisor::judge(std::int64_t now,
                                                  const Activity& activity) const {
  // Faults that need manual intervention come first: they persist whichever nodes are silent.
  if (const auto verdict = judge_manual_faults()) return *verdict;
  // Then nodes without heartbeats, before the messages that they no longer send.
  if (const auto verdict = judge_nodes(now, settings_.watched_nodes)) return *verdict;
  if (const auto verdict = judge_arms(now, activity.engaged)) return *verdict;
  if (const auto verdict = judge_facility(now)) return *verdict;
  if (!activity.closed_loop) return {};
  if (const auto verdict = judge_nodes(now, settings_.watched_in_closed_loop)) return *verdict;
  if (const auto verdict = judge_sensor(now)) return *verdict;
  return judge_node_faults().value_or(Verdict{});
}

std::optional<SafetySupervisor::Verdict> SafetySupervisor::judge_node_faults() const {
  for (const std::string& node : settings_.watched_in_closed_loop) {
    const auto fault = node_faults_.find(node);
    if (fault == node_faults_.end() || fault->second.empty()) continue;
    return Verdict{Level::hold, "node-fault", fault->second};
  }
  return std::nullopt;
}

std::optional<SafetySupervisor::Verdict> SafetySupervisor::judge_manual_faults() const {
  for (const ArmRole role : both_arms) {
    const std::optional<ArmReport>& report = arm(role);
    if (!report) continue;
    const std::string why = report->reason.empty() ? "" : ": " + report->reason;
    if (report->state == ArmState::estop) {
      return Verdict{Level::fault, "arm-estop",
                     arm_name(role) + "'s controller is in emergency stop" + why};
    }
    if (report->state == ArmState::fault) {
      return Verdict{Level::fault, "arm-fault", arm_name(role) + "'s controller has a fault" + why};
    }
  }
  return judge_chain();
}

std::optional<SafetySupervisor::Verdict> SafetySupervisor::judge_chain() const {
  if (!facility_) return std::nullopt;
  if (!facility_->estop_closed) {
    return Verdict{Level::fault, "estop", "an emergency stop is pressed"};
  }
  if (!facility_->fence_closed) return Verdict{Level::fault, "fence", "the fence is open"};
  if (!facility_->motion_enabled) {
    return Verdict{Level::fault, "motion-disabled", "the PLC does not enable motion"};
  }
  return std::nullopt;
}

std::string SafetySupervisor::unresettable_fault() const {
  const std::optional<Verdict> manual = judge_manual_faults();
  if (manual && manual->code == "arm-estop") return manual->reason;
  // A controller's reason for an open chain is more specific than the PLC's.
  return judge_chain() ? manual->reason : "";
}

std::optional<SafetySupervisor::Verdict> SafetySupervisor::judge_arms(std::int64_t now,
                                                                      bool engaged) const {
  for (const ArmRole role : both_arms) {
    const std::optional<ArmReport>& report = arm(role);
    const std::string why = report && !report->reason.empty() ? ": " + report->reason : "";
    if (!report || report->received == 0) {
      return Verdict{Level::not_ready, "arm-unknown",
                     arm_name(role) + " has not reported yet" + why};
    }
    const std::int64_t silence = now - report->received;
    if (silence > settings_.arm_silence) {
      return Verdict{Level::hold, "arm-silent",
                     "no joints from " + arm_name(role) + " for " + milliseconds(silence) + why};
    }
    if (engaged && report->state != ArmState::running) {
      return Verdict{Level::held, "arm-stopped", arm_name(role) + " stopped by itself" + why};
    }
  }
  return std::nullopt;
}

std::optional<SafetySupervisor::Verdict> SafetySupervisor::judge_facility(std::int64_t now) const {
  if (!facility_) return Verdict{Level::not_ready, "facility-unknown", facility_reason_};
  if (!facility_->valid) return Verdict{Level::hold, "facility-silent", facility_reason_};
  const std::int64_t silence = now - facility_->received;
  if (silence <= settings_.facility_silence) return std::nullopt;
  return Verdict{Level::hold, "facility-silent",
                 "no word from the PLC for " + milliseconds(silence)};
}

std::optional<SafetySupervisor::Verdict> SafetySupervisor::judge_nodes(
    std::int64_t now, const std::vector<std::string>& nodes) const {
  for (const std::string& node : nodes) {
    const auto heartbeat = heartbeats_.find(node);
    if (heartbeat == heartbeats_.end()) {
      return Verdict{Level::not_ready, "heartbeat-unknown", node + " has not reported yet"};
    }
    const std::int64_t silence = now - heartbeat->second;
    if (silence <= settings_.heartbeat_silence) continue;
    return Verdict{Level::hold, "heartbeat-lost",
                   "no heartbeat of " + node + " for " + milliseconds(silence)};
  }
  return std::nullopt;
}

std::optional<SafetySupervisor::Verdict> SafetySupervisor::judge_sensor(std::int64_t now) const {
  if (!lidar_fault_.empty()) return Verdict{Level::hold, "lidar-lost", lidar_fault_};
  if (!scan_running_) return std::nullopt;
  // The limit grows with the packet interval, so that a slow LIDAR does not count as silent.
  const std::int64_t allowed = std::max(settings_.scan_silence, 3 * scan_interval_);
  const std::int64_t silence = now - scan_received_;
  if (silence <= allowed) return std::nullopt;
  return Verdict{
      Level::hold, "scan-silent",
      "the LIDAR is silent in the midst of a scan: no returns for " + milliseconds(silence)};
}

}  // namespace berth::testbed
