// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/testbed_link.h"

#include "procedures/engine/motion_command.h"

namespace berth::procedures {
namespace {

/// A lease lasts for two seconds, and must not be lost with a fifth of the messages: ten in a row,
/// once in ten million.
constexpr Utime lease_period = 200 * millisecond;

}  // namespace

TestbedLink::TestbedLink(Actions& actions, Commander commander)
    : actions_(actions),
      commander_(std::move(commander)),
      motion_([&actions](const testbed_command2_t& command) { actions.send(command); }),
      order_([&actions](const testbed_command2_t& command) { actions.send(command); }) {}

void TestbedLink::command(testbed_command2_t command, Utime now) {
  command.speed_override = override_;
  refusal_.clear();
  motion_.send(std::move(command), commander_, now);
}

void TestbedLink::order(std::int8_t what, Utime now) {
  testbed_command2_t command = testbed_command_of(what);
  command.speed_override = override_;
  order_.send(std::move(command), commander_, now);
}

void TestbedLink::send_lease(std::int8_t what, Utime now) {
  testbed_command2_t command = testbed_command_of(what);
  command.speed_override = override_;
  complete(command, commander_, now);
  lease_sent_ = now;
  actions_.send(command);
}

void TestbedLink::keep_lease(Utime now) {
  send_lease(holds_lease_ ? testbed_command2_t::KEEP_LEASE : testbed_command2_t::TAKE_LEASE, now);
}

void TestbedLink::set_override(double override, Utime now) {
  override_ = motion_.command().speed_override = order_.command().speed_override = override;
  if (holds_lease_) keep_lease(now);  // at once; it is sent again with every one that follows
}

void TestbedLink::take_lease(Utime now) {
  wants_lease_ = true;
  keep_lease(now);
}

void TestbedLink::release_lease(Utime now) {
  if (!wants_lease_) return;
  wants_lease_ = false;
  send_lease(testbed_command2_t::RELEASE_LEASE, now);
}

void TestbedLink::on(const testbed_state_t& state) {
  state_ = state;
  holds_lease_ = state.lease_holder == commander_.name;
  held_once_ = held_once_ || (wants_lease_ && holds_lease_);
  // Closed loop motion that ends otherwise than it should gives the reason in the same place.
  const bool under_way = motion_.status() == CommandStatus::accepted;
  if (motion_.on(state)) refusal_ = (under_way ? "" : "the testbed refuses: ") + motion_.reason();
  order_.on(state);
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
  if (wants_lease_ && now - lease_sent_ >= lease_period) keep_lease(now);
  motion_.tick(now);
  order_.tick(now);
}

}  // namespace berth::procedures
