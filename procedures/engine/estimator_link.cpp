// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/estimator_link.h"

namespace berth::procedures {

EstimatorLink::EstimatorLink(Actions& actions, Commander commander)
    : actions_(actions), commander_(std::move(commander)), last_seq_(commander_.last_seq) {}

void EstimatorLink::command(estimator_command_t command, Utime now) {
  command_ = std::move(command);
  attempts_ = 0;
  send_anew(now);
}

void EstimatorLink::send_anew(Utime now) {
  ++attempts_;
  command_.utime = now;
  command_.seq = ++last_seq_;
  command_.session = commander_.session;
  command_.commander = commander_.name;
  // A busy estimator has asked for its next scan already: the one after that is the first to
  // change.
  const bool busy = state_ && (state_->mode == estimator_state_t::ACQUIRING ||
                               state_->mode == estimator_state_t::TRACKING);
  command_.first_scan_id = (state_ ? state_->scan_id : 0) + (busy ? 2 : 1);
  answer_ = Answer::pending;
  refusal_.clear();
  sent_ = now;
  actions_.send(command_);
}

void EstimatorLink::on(const estimator_state_t& state, Utime now) {
  state_ = state;
  if (answer_ != Answer::pending) return;
  if (state.refused_seq == command_.seq) {
    constexpr int most_attempts = 5;
    const bool late = state.reason.rfind("late", 0) == 0;
    if (late && attempts_ < most_attempts) {
      send_anew(now);
    } else {
      answer_ = Answer::refused;
      refusal_ = state.reason;
    }
  } else if (state.command_seq == command_.seq) {
    answer_ = Answer::accepted;
  }
}

void EstimatorLink::tick(Utime now) {
  if (answer_ == Answer::pending && now - sent_ >= repeat_period) {
    sent_ = now;
    actions_.send(command_);
  }
}

}  // namespace berth::procedures
