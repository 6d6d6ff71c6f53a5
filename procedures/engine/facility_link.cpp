// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/facility_link.h"

#include <cmath>

namespace berth::procedures {

FacilityLink::FacilityLink(Actions& actions, Commander commander)
    : actions_(actions), commander_(std::move(commander)) {}

void FacilityLink::command(facility_command_t command, Utime now) {
  const std::int64_t seq = command_.seq + 1;
  command_ = std::move(command);
  command_.seq = seq;
  wanted_ = true;
  send(now);
}

void FacilityLink::send(Utime now) {
  command_.utime = now;
  command_.utime_expires = now + command_lifetime;
  command_.session = commander_.session;
  command_.commander = commander_.name;
  sent_ = now;
  actions_.send(command_);
}

bool FacilityLink::reached() const { return sent_ != 0 && !wanted_; }

void FacilityLink::on(const facility_state_t& state) {
  state_ = state;
  constexpr double tolerance = 0.02;
  if (state.valid && state.utime >= command_.utime &&
      std::abs(state.sun_lamp - command_.sun_lamp) <= tolerance &&
      std::abs(state.albedo_lamp - command_.albedo_lamp) <= tolerance) {
    wanted_ = false;
  }
}

void FacilityLink::tick(Utime now) {
  if (wanted_ && now - sent_ >= repeat_period) send(now);
}

}  // namespace berth::procedures
