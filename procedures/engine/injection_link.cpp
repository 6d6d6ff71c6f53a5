// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/injection_link.h"

#include <algorithm>

namespace berth::procedures {

InjectionLink::InjectionLink(Actions& actions, Commander commander)
    : actions_(actions), commander_(std::move(commander)), last_seq_(commander_.last_seq) {}

void InjectionLink::command(injection_t injection, Utime now) {
  if (injection.action != injection_t::INJECT) {
    std::erase_if(later_, [&](const Later& later) {
      const bool device = later.injection.device == injection.device;
      const bool fault = injection.fault.empty() || later.injection.fault == injection.fault;
      return injection.action == injection_t::CLEAR_ALL || (device && fault);
    });
  }
  injection_ = std::move(injection);
  injection_.seq = ++last_seq_;
  used_ = used_ || injection_.action == injection_t::INJECT;
  answer_ = Answer::pending;
  refusal_.clear();
  send(now);
}

void InjectionLink::command_later(injection_t injection, Utime due) {
  used_ = true;
  later_.push_back({std::move(injection), due});
}

void InjectionLink::send(Utime now) {
  injection_.utime = now;
  injection_.utime_expires = now + command_lifetime;
  injection_.session = commander_.session;
  injection_.commander = commander_.name;
  sent_ = now;
  actions_.send(injection_);
}

void InjectionLink::on(const injection_state_t& state) {
  state_ = state;
  if (answer_ != Answer::pending) return;
  if (state.refused_seq == injection_.seq) {
    answer_ = Answer::refused;
    refusal_ = state.refusal;
  } else if (state.accepted_seq == injection_.seq) {
    answer_ = Answer::accepted;
  }
}

void InjectionLink::tick(Utime now) {
  if (answer_ == Answer::pending) {
    if (now - sent_ >= repeat_period) send(now);
    return;
  }
  const auto due = std::find_if(later_.begin(), later_.end(),
                                [&](const Later& later) { return later.due <= now; });
  if (due == later_.end()) return;
  injection_t injection = std::move(due->injection);
  later_.erase(due);
  command(std::move(injection), now);
}

}  // namespace berth::procedures
