// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/estimator_link.h"

namespace berth::procedures {

EstimatorLink::EstimatorLink(Actions& actions, Commander commander)
    : commander_(std::move(commander)),
      client_([&actions](const estimator_command_t& command) { actions.send(command); }) {}

void EstimatorLink::command(estimator_command_t command, Utime now) {
  attempts_ = 0;
  send(std::move(command), now);
}

void EstimatorLink::send(estimator_command_t command, Utime now) {
  ++attempts_;
  // A busy estimator has requested its next scan already: the one after that is the first to
  // change.
  const bool busy = state_ && (state_->mode == estimator_state_t::ACQUIRING ||
                               state_->mode == estimator_state_t::TRACKING);
  command.first_scan_id = (state_ ? state_->scan_id : 0) + (busy ? 2 : 1);
  client_.send(std::move(command), commander_, now);
}

void EstimatorLink::on(const estimator_state_t& state, Utime now) {
  state_ = state;
  const bool answered = client_.on(state);
  if (!answered || client_.status() != CommandStatus::refused) return;
  constexpr int max_attempts = 5;
  const bool late = state.scan_id >= first_scan_id();
  if (late && attempts_ < max_attempts) send(client_.command(), now);
}

}  // namespace berth::procedures
