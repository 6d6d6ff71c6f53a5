// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/injection_link.h"

#include <algorithm>

namespace berth::procedures {

InjectionLink::InjectionLink(Actions& actions, Commander commander)
    : commander_(std::move(commander)),
      client_([&actions](const injection_t& injection) { actions.send(injection); }) {}

void InjectionLink::command(injection_t injection, Utime now) {
  if (injection.action != injection_t::INJECT) {
    std::erase_if(later_, [&](const Later& later) {
      const bool device = later.injection.device == injection.device;
      const bool fault = injection.fault.empty() || later.injection.fault == injection.fault;
      return injection.action == injection_t::CLEAR_ALL || (device && fault);
    });
  }
  used_ = used_ || injection.action == injection_t::INJECT;
  client_.send(std::move(injection), commander_, now);
}

void InjectionLink::command_later(injection_t injection, Utime due) {
  used_ = true;
  later_.push_back({std::move(injection), due});
}

void InjectionLink::on(const injection_state_t& state) {
  state_ = state;
  client_.on(state);
}

void InjectionLink::tick(Utime now) {
  client_.tick(now);
  if (client_.pending()) return;
  const auto due = std::find_if(later_.begin(), later_.end(),
                                [&](const Later& later) { return later.due <= now; });
  if (due == later_.end()) return;
  injection_t injection = std::move(due->injection);
  later_.erase(due);
  command(std::move(injection), now);
}

}  // namespace berth::procedures
