// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/cell_status.h"

#include <algorithm>
#include <berth/heartbeat_t.hpp>
#include <cmath>

#include "common/core/text.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/good_estimate.h"

namespace berth::console {
namespace {

template <class Message>
void keep(const logs::LogEvent& event, const char* channel, std::optional<Message>& latest) {
  if (auto message = logs::decode<Message>(event, channel)) latest = std::move(message);
}

}  // namespace

void CellMessages::take(const logs::LogEvent& event) {
  keep(event, channels::arm_state_replica, replica_arm);
  keep(event, channels::arm_state_sensor, sensor_arm);
  keep(event, channels::facility_state, facility);
  keep(event, channels::lidar_state, lidar);
  keep(event, channels::pose_estimate, estimate);
  keep(event, channels::procedure_state, procedure);
  keep(event, channels::testbed_state, testbed);
  if (const auto message = logs::decode<ground_truth_t>(event, channels::ground_truth)) {
    truth = evaluation::sample_of(*message);
  } else if (auto status = logs::decode<node_status_t>(event, channels::node_status)) {
    nodes[status->node] = std::move(*status);
  } else if (const auto beat = logs::decode<heartbeat_t>(event, channels::heartbeat)) {
    beats[beat->node] = event.utime;
  }
}

std::optional<evaluation::TruthSample> CellMessages::truth_at(Utime now) const {
  return truth && now - truth->utime <= second ? truth : std::nullopt;
}

namespace {

// A node counts as dead for the others after 150 ms; a busy screen here must not raise a false
// alarm.
constexpr Utime silence = 500 * millisecond;
constexpr double still_m_s = 1e-3;

std::string with_reason(const std::string& what, const std::string& reason) {
  return reason.empty() ? what : what + ": " + reason;
}

std::string stopped(const CellMessages& latest) {
  if (latest.facility && latest.facility->valid) {
    if (!latest.facility->estop_chain_closed) return "E-stop chain open";
    if (!latest.facility->fence_closed) return "fence open";
  }
  for (const auto* arm : {&latest.replica_arm, &latest.sensor_arm}) {
    if (!*arm) continue;
    const std::string name = arm == &latest.replica_arm ? "replica arm" : "sensor arm";
    if ((*arm)->state == arm_state_t::ESTOP) return with_reason(name + " E-stop", (*arm)->reason);
    if ((*arm)->state == arm_state_t::FAULT) return with_reason(name + " fault", (*arm)->reason);
  }
  if (latest.testbed && latest.testbed->state == testbed_state_t::FAULT) {
    return with_reason("testbed fault", latest.testbed->reason);
  }
  return {};
}

std::string node_trouble(const CellMessages& latest, Utime now) {
  for (const auto& [name, beat] : latest.beats) {
    const auto status = latest.nodes.find(name);
    // A node that reported its stop may be silent.
    if (status != latest.nodes.end() && status->second.state == node_status_t::STOPPED) continue;
    if (now - beat > silence) return name + " silent for " + fixed(seconds(now - beat), 1) + " s";
  }
  for (const auto& [name, status] : latest.nodes) {
    if (status.state == node_status_t::FAULT) return with_reason(name + " fault", status.reason);
    // A testbed that holds on request is as it should be.
    const bool requested =
        name == "testbed" && latest.testbed && latest.testbed->state == testbed_state_t::HELD;
    if (status.state == node_status_t::DEGRADED && !requested) {
      return with_reason(name + " degraded", status.reason);
    }
  }
  return {};
}

std::string attention(const CellMessages& latest, Utime now) {
  if (latest.beats.empty()) return "no heartbeat from any node";
  const std::string trouble = node_trouble(latest, now);
  if (!trouble.empty()) return trouble;
  if (latest.facility && !latest.facility->valid) {
    return with_reason("PLC does not answer", latest.facility->reason);
  }
  for (const auto* arm : {&latest.replica_arm, &latest.sensor_arm}) {
    if (*arm && (*arm)->state == arm_state_t::OFFLINE) {
      return with_reason(arm == &latest.replica_arm ? "replica arm offline" : "sensor arm offline",
                         (*arm)->reason);
    }
  }
  const bool flown = latest.testbed && (latest.testbed->state == testbed_state_t::CLOSED_LOOP ||
                                        latest.testbed->state == testbed_state_t::HOLDING);
  if (flown && latest.estimate && !is_good(*latest.estimate)) {
    return with_reason("no good estimate to fly by", latest.estimate->status == pose_estimate_t::OK
                                                         ? estimate_defect(*latest.estimate)
                                                         : latest.estimate->reason);
  }
  if (latest.procedure && latest.procedure->state == procedure_state_t::PROMPTING) {
    return with_reason("an operator is prompted", latest.procedure->prompt);
  }
  return {};
}

std::string held(const CellMessages& latest) {
  if (latest.procedure && latest.procedure->state == procedure_state_t::HELD) {
    return with_reason("procedure held", latest.procedure->reason);
  }
  if (latest.testbed && latest.testbed->state == testbed_state_t::HELD) {
    return with_reason("motion held", latest.testbed->reason);
  }
  return {};
}

std::string moving(const CellMessages& latest) {
  double fastest = 0;
  for (const auto* arm : {&latest.replica_arm, &latest.sensor_arm}) {
    if (*arm && (*arm)->valid) fastest = std::max(fastest, std::abs((*arm)->tcp_speed_m_s));
  }
  const bool ordered = latest.testbed && (latest.testbed->state == testbed_state_t::MOVING ||
                                          latest.testbed->state == testbed_state_t::CLOSED_LOOP ||
                                          latest.testbed->state == testbed_state_t::HOLDING);
  if (!ordered && fastest < still_m_s) return {};
  return fastest < still_m_s ? "a motion is being carried out"
                             : "arms at " + fixed(1e3 * fastest, 0) + " mm/s";
}

}  // namespace

CellStatus cell_status(const CellMessages& latest, Utime now) {
  if (std::string why = stopped(latest); !why.empty()) return {"stop", why};
  if (std::string why = attention(latest, now); !why.empty()) {
    const std::string motion = moving(latest);
    return {"attention", motion.empty() ? why : why + "; " + motion};
  }
  if (std::string why = held(latest); !why.empty()) return {"held", why};
  if (std::string why = moving(latest); !why.empty()) return {"moving", why};
  return {"safe", "nothing moves"};
}

}  // namespace berth::console
