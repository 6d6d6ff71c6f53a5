// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/links.h"

#include <cmath>

namespace berth::procedures {

TestbedLink::TestbedLink(Actions& actions, Commander commander)
    : actions_(actions), commander_(std::move(commander)) {}

void TestbedLink::send(testbed_command_t& command, Utime now) {
  command.utime = now;
  command.utime_expires = now + command_lifetime;
  command.session = commander_.session;
  command.commander = commander_.name;
  actions_.send(command);
}

void TestbedLink::start(Tracked& tracked, testbed_command_t command, Utime now) {
  tracked.command = std::move(command);
  tracked.command.seq = ++last_seq_;
  tracked.answer = Answer::pending;
  tracked.refusal.clear();
  tracked.sent = now;
  send(tracked.command, now);
}

void TestbedLink::command(testbed_command_t command, Utime now) {
  start(motion_, std::move(command), now);
}

void TestbedLink::order(std::int8_t what, Utime now) {
  testbed_command_t command{};
  command.command = what;
  command.q_wxyz[0] = 1;
  start(order_, std::move(command), now);
}

void TestbedLink::send_lease(Utime now) {
  testbed_command_t command{};
  command.command = holds_lease_ ? testbed_command_t::KEEP_LEASE : testbed_command_t::TAKE_LEASE;
  command.q_wxyz[0] = 1;
  command.seq = ++last_seq_;
  lease_sent_ = now;
  send(command, now);
}

void TestbedLink::take_lease(Utime now) {
  wants_lease_ = true;
  send_lease(now);
}

void TestbedLink::release_lease(Utime now) {
  if (!wants_lease_) return;
  wants_lease_ = false;
  testbed_command_t command{};
  command.command = testbed_command_t::RELEASE_LEASE;
  command.q_wxyz[0] = 1;
  command.seq = ++last_seq_;
  send(command, now);
}

void TestbedLink::look_for_answer(Tracked& tracked, const testbed_state_t& state) {
  if (tracked.answer != Answer::pending && tracked.answer != Answer::accepted) return;
  const std::int64_t seq = tracked.command.seq;
  if (state.refused_seq == seq) {
    tracked.answer = Answer::refused;
    tracked.refusal = state.refusal;
  } else if (state.finished_seq == seq) {
    tracked.answer = Answer::finished;
  } else if (state.command_seq == seq) {
    tracked.answer = Answer::accepted;
  }
}

void TestbedLink::on(const testbed_state_t& state) {
  state_ = state;
  holds_lease_ = state.lease_holder == commander_.name;
  held_once_ = held_once_ || (wants_lease_ && holds_lease_);
  look_for_answer(motion_, state);
  look_for_answer(order_, state);
}

void TestbedLink::tick(Utime now) {
  if (wants_lease_ && now - lease_sent_ >= repeat_period) send_lease(now);
  for (Tracked* tracked : {&motion_, &order_}) {
    if (tracked->answer != Answer::pending || now - tracked->sent < repeat_period) continue;
    tracked->sent = now;
    send(tracked->command, now);
  }
}

EstimatorLink::EstimatorLink(Actions& actions, Commander commander)
    : actions_(actions), commander_(std::move(commander)) {}

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
