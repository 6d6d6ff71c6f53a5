// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/cell_status.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "lcmtypes/good_estimate.h"

namespace berth::console {
namespace {

// A node is dead for the others after 150 ms; here a busy screen must not cry wolf.
constexpr Utime silence = 500 * millisecond;
constexpr double still_m_s = 1e-3;

std::string with_reason(const std::string& what, const std::string& reason) {
  return reason.empty() ? what : what + ": " + reason;
}

std::string stopped(const LatestMessages& heard) {
  if (heard.facility && heard.facility->valid) {
    if (!heard.facility->estop_chain_closed) return "E-stop chain open";
    if (!heard.facility->fence_closed) return "fence open";
  }
  for (const auto* arm : {&heard.replica_arm, &heard.sensor_arm}) {
    if (!*arm) continue;
    const std::string name = arm == &heard.replica_arm ? "replica arm" : "sensor arm";
    if ((*arm)->state == arm_state_t::ESTOP) return with_reason(name + " E-stop", (*arm)->reason);
    if ((*arm)->state == arm_state_t::FAULT) return with_reason(name + " fault", (*arm)->reason);
  }
  if (heard.testbed && heard.testbed->state == testbed_state_t::FAULT) {
    return with_reason("testbed fault", heard.testbed->reason);
  }
  return {};
}

std::string node_trouble(const LatestMessages& heard, Utime now) {
  for (const auto& [name, beat] : heard.beats) {
    const auto status = heard.nodes.find(name);
    // Who said that it stops may be silent.
    if (status != heard.nodes.end() && status->second.state == node_status_t::STOPPED) continue;
    if (now - beat > silence) return name + " silent for " + fixed(seconds(now - beat), 1) + " s";
  }
  for (const auto& [name, status] : heard.nodes) {
    if (status.state == node_status_t::FAULT) return with_reason(name + " fault", status.reason);
    // A testbed that holds because it was told to is as it should be.
    const bool told =
        name == "testbed" && heard.testbed && heard.testbed->state == testbed_state_t::HELD;
    if (status.state == node_status_t::DEGRADED && !told) {
      return with_reason(name + " degraded", status.reason);
    }
  }
  return {};
}

std::string attention(const LatestMessages& heard, Utime now) {
  if (heard.beats.empty()) return "no node is heard";
  const std::string trouble = node_trouble(heard, now);
  if (!trouble.empty()) return trouble;
  if (heard.facility && !heard.facility->valid) {
    return with_reason("PLC does not answer", heard.facility->reason);
  }
  for (const auto* arm : {&heard.replica_arm, &heard.sensor_arm}) {
    if (*arm && (*arm)->state == arm_state_t::OFFLINE) {
      return with_reason(arm == &heard.replica_arm ? "replica arm offline" : "sensor arm offline",
                         (*arm)->reason);
    }
  }
  const bool flown = heard.testbed && (heard.testbed->state == testbed_state_t::CLOSED_LOOP ||
                                       heard.testbed->state == testbed_state_t::HOLDING);
  if (flown && heard.estimate && !is_good(*heard.estimate)) {
    return with_reason("no good estimate to fly by", heard.estimate->status == pose_estimate_t::OK
                                                         ? estimate_defect(*heard.estimate)
                                                         : heard.estimate->reason);
  }
  if (heard.procedure && heard.procedure->state == procedure_state_t::PROMPTING) {
    return with_reason("an operator is asked", heard.procedure->prompt);
  }
  return {};
}

std::string held(const LatestMessages& heard) {
  if (heard.procedure && heard.procedure->state == procedure_state_t::HELD) {
    return with_reason("procedure held", heard.procedure->reason);
  }
  if (heard.testbed && heard.testbed->state == testbed_state_t::HELD) {
    return with_reason("motion held", heard.testbed->reason);
  }
  return {};
}

std::string moving(const LatestMessages& heard) {
  double fastest = 0;
  for (const auto* arm : {&heard.replica_arm, &heard.sensor_arm}) {
    if (*arm && (*arm)->valid) fastest = std::max(fastest, std::abs((*arm)->tcp_speed_m_s));
  }
  const bool ordered = heard.testbed && (heard.testbed->state == testbed_state_t::MOVING ||
                                         heard.testbed->state == testbed_state_t::CLOSED_LOOP ||
                                         heard.testbed->state == testbed_state_t::HOLDING);
  if (!ordered && fastest < still_m_s) return {};
  return fastest < still_m_s ? "a motion is being carried out"
                             : "arms at " + fixed(1e3 * fastest, 0) + " mm/s";
}

}  // namespace

CellStatus cell_status(const LatestMessages& heard, Utime now) {
  if (std::string why = stopped(heard); !why.empty()) return {"stop", why};
  if (std::string why = attention(heard, now); !why.empty()) {
    const std::string motion = moving(heard);
    return {"attention", motion.empty() ? why : why + "; " + motion};
  }
  if (std::string why = held(heard); !why.empty()) return {"held", why};
  if (std::string why = moving(heard); !why.empty()) return {"moving", why};
  return {"safe", "nothing moves"};
}

}  // namespace berth::console
