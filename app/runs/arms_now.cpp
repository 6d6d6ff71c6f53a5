// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/arms_now.h"

#include <berth/arm_state_t.hpp>

#include "common/bus/lcm_bus.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"

namespace berth {

std::optional<testbed::ArmPair> arms_now(const std::string& url, std::int64_t session) {
  ProcessLoop loop(clock_offset_now());
  testbed::ArmPair arms;
  bool received[2] = {false, false};
  {
    LcmBus bus(url, loop);
    for (const ArmRole role : testbed::both_arms) {
      bus.subscribe<arm_state_t>(
          role == ArmRole::replica ? channels::arm_state_replica : channels::arm_state_sensor,
          Queue::latest(), [&, role](const arm_state_t& state) {
            const auto joints = reported_joints(state);
            if (state.session != session || !joints) return;
            arms.of(role) = *joints;
            received[role == ArmRole::replica ? 0 : 1] = true;
            if (received[0] && received[1]) loop.stop();
          });
    }
    loop.after(second, [&loop] { loop.stop(); });
    bus.start();
    loop.run();
  }
  if (!received[0] || !received[1]) return std::nullopt;
  return arms;
}

}  // namespace berth
