// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/injection_link.h"

namespace berth::procedures {

InjectionLink::InjectionLink(Actions& actions, Commander commander)
    : actions_(actions), commander_(std::move(commander)), last_seq_(commander_.last_seq) {}

void InjectionLink::command(injection_t injection, Utime now) {
  injection_ = std::move(injection);
  injection_.seq = ++last_seq_;
  used_ = used_ || injection_.action == injection_t::INJECT;
  answer_ = Answer::pending;
  refusal_.clear();
  send(now);
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
  if (answer_ == Answer::pending && now - sent_ >= repeat_period) send(now);
}

}  // namespace berth::procedures
