// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/control/cell_client.h"

#include <cmath>
#include <utility>

#include "common/core/error.h"
#include "lcmtypes/channels.h"
#include "procedures/engine/operator_control.h"

namespace berth::console {
namespace {

constexpr Utime answer_limit = 2 * second;

}  // namespace

CellClient::CellClient(Bus& bus, Loop& loop, std::int64_t session)
    : bus_(bus), loop_(loop), session_(session) {
  receive<testbed_state_t>(channels::testbed_state);
  receive<facility_state_t>(channels::facility_state);
  receive<command_answers_t>(channels::facility_answers);
}

template <class Message>
void CellClient::receive(const char* channel) {
  bus_.subscribe<Message>(channel, Queue::fifo(), [this](const Message& message) {
    if (message.session == session_) on(message);
  });
}

Commander CellClient::commander(const std::string& operator_name) const {
  // The testbed numbers each commander's orders: a later one goes on above the earlier.
  return {operator_name, session_, loop_.now()};
}

void CellClient::on(const testbed_state_t& state) {
  latest_.on(state);
  if (links_) links_->testbed.on(state);
  if (hold_) {
    hold_->on(state);
    if (!hold_->order_pending()) end(hold_waiting_, CommandStatus::accepted);
  }
  constexpr double same = 1e-6;
  if (links_ && std::abs(state.speed_override - links_->testbed.override()) < same) {
    end(speed_waiting_, CommandStatus::accepted);
  }
}

void CellClient::on(const facility_state_t& state) {
  latest_.on(state);
  if (links_) links_->facility.on(state);
}

void CellClient::on(const command_answers_t& facility) {
  if (!links_) return;
  procedures::FacilityLink& lamps = links_->facility;
  lamps.on(facility);
  if (!lamps.pending()) end(lamps_waiting_, lamps.status(), lamps.refusal());
}

void CellClient::wait(Waiting& waiting, Done done) {
  end(waiting, CommandStatus::unanswered, "a later one took its place");
  waiting = {std::move(done), loop_.now()};
}

void CellClient::end(Waiting& waiting, CommandStatus status, const std::string& reason) {
  if (const Done done = std::exchange(waiting.done, {})) done(status, reason);
}

void CellClient::tick() {
  const Utime now = loop_.now();
  if (hold_) hold_->tick(now);
  if (links_) {
    links_->testbed.tick(now);
    links_->facility.tick(now);
  }
  for (Waiting* waiting : {&hold_waiting_, &speed_waiting_, &lamps_waiting_}) {
    if (now - waiting->since < answer_limit) continue;
    end(*waiting, CommandStatus::unanswered,
        waiting == &lamps_waiting_ ? "the facility does not answer"
                                   : "the testbed does not answer");
  }
}

void CellClient::take(const std::string& operator_name) {
  if (taken_for_ == operator_name) return;
  give_back();
  taken_for_ = operator_name;
  links_ = std::make_unique<Links>(
      Links{{actions(), commander(operator_name)}, {actions(), commander(operator_name)}});
  if (latest_.facility) links_->facility.on(*latest_.facility);
  links_->testbed.take_lease(loop_.now());
}

void CellClient::give_back() {
  if (links_) links_->testbed.release_lease(loop_.now());
  links_.reset();
  taken_for_.clear();
}

void CellClient::hold(const std::string& operator_name, Done done) {
  wait(hold_waiting_, std::move(done));
  hold_.emplace(actions(), commander(operator_name));
  hold_->order(testbed_command2_t::HOLD, loop_.now());
}

void CellClient::set_speed(double override, Done done) {
  wait(speed_waiting_, std::move(done));
  if (links_) links_->testbed.set_override(override, loop_.now());
}

void CellClient::set_lamps(const std::string& text, Done done) {
  if (!latest_.facility || latest_.facility->valid == 0)
    throw InputError("the facility does not answer");
  const facility_command_t command = procedures::lamps_of(text, *latest_.facility);
  wait(lamps_waiting_, std::move(done));
  if (links_) links_->facility.command(command, loop_.now());
}

void CellClient::send(const testbed_command2_t& command) {
  bus_.publish(channels::testbed_command, command);
}

void CellClient::send(const facility_command_t& command) {
  bus_.publish(channels::facility_command, command);
}

}  // namespace berth::console
