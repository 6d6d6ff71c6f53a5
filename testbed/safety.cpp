// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety.h"

#include "common/core/text.h"

namespace berth::testbed {
namespace {

std::string milliseconds(std::int64_t us) {
  return fixed(static_cast<double>(us) * 1e-3, 0) + " ms";
}

std::string arm_name(ArmRole role) { return std::string("the ") + name_of(role) + " arm"; }

}  // namespace

SafetySupervisor::SafetySupervisor(Settings settings) : settings_(std::move(settings)) {}

void SafetySupervisor::on_arm(ArmRole role, const ArmReport& report) {
  std::optional<ArmReport>& last = role == ArmRole::replica ? replica_ : sensor_;
  const std::int64_t last_valid = last ? last->received : 0;
  last = report;
  // silence counts from the last joints that could be used
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
    return;
  }
  facility_ = Facility{received, estop_closed, fence_closed, motion_enabled};
}

std::string SafetySupervisor::lag(ArmRole role, const ArmKinematics& arm, const Joints& reported,
                                  const Joints& commanded) const {
  for (std::size_t i = 0; i < 6; ++i) {
    const double away = std::abs(reported[i] - commanded[i]);
    if (away <= settings_.largest_lag) continue;
    const bool linear = arm.is_linear(static_cast<int>(i));
    return arm_name(role) + "'s joint " + std::to_string(i + 1) + " is " +
           (linear ? fixed(1e3 * away, 0) + " mm" : fixed(degrees(away), 1) + " deg") +
           " away from where it was told to be";
  }
  return "";
}

SafetySupervisor::Verdict SafetySupervisor::judge(std::int64_t now, bool engaged) const {
  // What is put right by hand comes first: it stays true however silent the others are.
  for (const ArmRole role : both_arms) {
    const std::optional<ArmReport>& report = arm(role);
    if (!report) continue;
    const std::string why = report->reason.empty() ? "" : ": " + report->reason;
    if (report->state == ArmState::estop) {
      return {Level::fault, "arm-estop",
              arm_name(role) + "'s controller is in emergency stop" + why};
    }
    if (report->state == ArmState::fault) {
      return {Level::fault, "arm-fault", arm_name(role) + "'s controller has a fault" + why};
    }
  }
  if (facility_) {
    if (!facility_->estop_closed) return {Level::fault, "estop", "an emergency stop is pressed"};
    if (!facility_->fence_closed) return {Level::fault, "fence", "the fence is open"};
    if (!facility_->motion_enabled) {
      return {Level::fault, "motion-disabled", "the PLC does not enable motion"};
    }
  }
  for (const ArmRole role : both_arms) {
    const std::optional<ArmReport>& report = arm(role);
    if (!report || report->received == 0) {
      const std::string why = report && !report->reason.empty() ? ": " + report->reason : "";
      return {Level::not_ready, "arm-unknown", arm_name(role) + " has not been heard yet" + why};
    }
    const std::int64_t silence = now - report->received;
    if (silence > settings_.arm_silence) {
      std::string text = "no joints from " + arm_name(role) + " for " + milliseconds(silence);
      if (!report->reason.empty()) text += ": " + report->reason;
      return {Level::hold, "arm-silent", text};
    }
    if (engaged && report->state != ArmState::running) {
      return {Level::held, "arm-stopped",
              arm_name(role) + " stopped by itself" +
                  (report->reason.empty() ? "" : ": " + report->reason)};
    }
  }
  if (!facility_) return {Level::not_ready, "facility-unknown", facility_reason_};
  if (now - facility_->received > settings_.facility_silence) {
    return {Level::hold, "facility-silent",
            "no word from the PLC for " + milliseconds(now - facility_->received)};
  }
  for (const std::string& node : settings_.watched_nodes) {
    const auto heard = heartbeats_.find(node);
    if (heard == heartbeats_.end()) {
      return {Level::not_ready, "heartbeat-unknown", node + " has not been heard yet"};
    }
    if (now - heard->second > settings_.heartbeat_silence) {
      return {Level::hold, "heartbeat-lost",
              "no heartbeat of " + node + " for " + milliseconds(now - heard->second)};
    }
  }
  return {};
}

}  // namespace berth::testbed
