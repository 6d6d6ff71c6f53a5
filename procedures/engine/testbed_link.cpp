// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/testbed_link.h"

namespace berth::procedures {
namespace {

Utime repeat_period_of(const testbed_command_t& command) {
  const bool stops =
      command.command == testbed_command_t::HOLD || command.command == testbed_command_t::STOP;
  return stops ? stop_repeat_period : repeat_period;
}

}  // namespace

TestbedLink::TestbedLink(Actions& actions, Commander commander)
    : actions_(actions), commander_(std::move(commander)), last_seq_(commander_.last_seq) {}

void TestbedLink::send(testbed_command_t& command, Utime now) {
  command.utime_expires = now + command_lifetime;
  command.session = commander_.session;
  command.commander = commander_.name;
  command.speed_override = override_;
  actions_.send(command);
}

void TestbedLink::start(Tracked& tracked, testbed_command_t command, Utime now) {
  tracked.command = std::move(command);
  tracked.command.utime = now;  // by which, with seq, a repetition is known
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
  command.utime = now;
  command.seq = ++last_seq_;
  lease_sent_ = now;
  send(command, now);
}

void TestbedLink::set_override(double override, Utime now) {
  override_ = override;
  if (holds_lease_) send_lease(now);  // at once; it is said again with every one that follows
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
  command.utime = now;
  command.seq = ++last_seq_;
  send(command, now);
}

void TestbedLink::look_for_answer(Tracked& tracked, const testbed_state_t& state) {
  if (tracked.answer != Answer::pending && tracked.answer != Answer::accepted) return;
  const std::int64_t seq = tracked.command.seq;
  if (state.refused_seq == seq) {
    // Closed loop motion that ends otherwise than it should says why in the same place.
    const bool under_way = tracked.answer == Answer::accepted;
    tracked.answer = Answer::refused;
    tracked.refusal = (under_way ? "" : "the testbed refuses: ") + state.refusal;
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

bool TestbedLink::at_rest() const {
  if (!state_) return false;
  switch (state_->state) {
    case testbed_state_t::MOVING:
    case testbed_state_t::CLOSED_LOOP:
    case testbed_state_t::HOLDING:
    case testbed_state_t::HELD:
      return false;
    default:
      return true;
  }
}

void TestbedLink::tick(Utime now) {
  if (wants_lease_ && now - lease_sent_ >= lease_period) send_lease(now);
  for (Tracked* tracked : {&motion_, &order_}) {
    if (tracked->answer != Answer::pending) continue;
    if (now - tracked->sent < repeat_period_of(tracked->command)) continue;
    tracked->sent = now;
    send(tracked->command, now);
  }
}

}  // namespace berth::procedures
