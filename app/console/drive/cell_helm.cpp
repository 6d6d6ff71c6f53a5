// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/drive/cell_helm.h"

#include "common/core/error.h"
#include "lcmtypes/channels.h"
#include "procedures/engine/operator_words.h"

namespace berth::console {

procedures::Commander CellHelm::commander(const std::string& who) const {
  // The testbed numbers each commander's orders: a later one goes on above the earlier.
  return {who, session_, loop_.now()};
}

void CellHelm::on(const testbed_state_t& state) {
  if (state.session != session_) return;
  testbed_ = state;
  if (links_) links_->testbed.on(state);
  if (hold_) hold_->on(state);
}

void CellHelm::on(const facility_state_t& state) {
  if (state.session != session_) return;
  facility_ = state;
  if (links_) links_->facility.on(state);
}

void CellHelm::tick() {
  if (hold_) hold_->tick(loop_.now());
  if (!links_) return;
  links_->testbed.tick(loop_.now());
  links_->facility.tick(loop_.now());
}

void CellHelm::take(const std::string& who) {
  if (taken_for_ == who) return;
  give_back();
  taken_for_ = who;
  links_ = std::make_unique<Links>(Links{procedures::TestbedLink(*this, commander(who)),
                                         procedures::FacilityLink(*this, commander(who))});
  if (facility_) links_->facility.on(*facility_);
  links_->testbed.take_lease(loop_.now());
}

void CellHelm::give_back() {
  if (links_) links_->testbed.release_lease(loop_.now());
  links_.reset();
  taken_for_.clear();
}

void CellHelm::hold(const std::string& who) {
  procedures::Actions& actions = *this;
  hold_.emplace(actions, commander(who));
  hold_->order(testbed_command_t::HOLD, loop_.now());
}

void CellHelm::set_speed(double override) {
  if (links_) links_->testbed.set_override(override, loop_.now());
}

void CellHelm::set_lamps(const std::string& text) {
  if (!facility_ || facility_->valid == 0) throw InputError("the facility does not answer");
  const facility_command_t command = procedures::lamps_of(text, *facility_);
  if (links_) links_->facility.command(command, loop_.now());
}

void CellHelm::send(const testbed_command_t& command) {
  bus_.publish(channels::testbed_command, command);
}

void CellHelm::send(const facility_command_t& command) {
  bus_.publish(channels::facility_command, command);
}

}  // namespace berth::console
