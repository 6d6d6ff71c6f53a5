// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/links.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "common/core/pose.h"
#include "common/core/text.h"
#include "procedures/engine/motion_steps.h"

namespace berth::procedures {
namespace {

/// A lease lasts for two seconds, ten periods: with a fifth of the messages lost, ten lost in a row
/// have a probability of 1e-7.
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
  // A closed-loop motion that fails reports its reason in the same field.
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

EstimatorLink::EstimatorLink(Actions& actions, Commander commander)
    : commander_(std::move(commander)),
      client_([&actions](const estimator_command_t& command) { actions.send(command); }) {}

void EstimatorLink::command(estimator_command_t command, Utime now) {
  attempts_ = 0;
  send(std::move(command), now);
}

void EstimatorLink::send(estimator_command_t command, Utime now) {
  ++attempts_;
  // A busy estimator has requested its next scan already: a command applies from the one after.
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

namespace {

// What the PLC's registers show (config/registers/plc.yaml) is rounded to a step of theirs.
constexpr double rounding = 0.5001;  // of a step
constexpr double level_step = 1e-4;
constexpr double angle_step = radians(0.01);

struct Item {
  const char* name;
  double requested;
  double shown;
  bool is_angle;

  bool reached() const {
    const double off = requested - shown;
    return is_angle ? std::abs(std::remainder(off, 2 * std::numbers::pi)) <= rounding * angle_step
                    : std::abs(off) <= rounding * level_step;
  }
  std::string text() const {
    const auto in_words = [this](double value) {
      return is_angle ? fixed(degrees(value), 2) + " deg" : fixed(100 * value, 2) + " %";
    };
    return std::string(name) + " " + in_words(shown) + " of " + in_words(requested);
  }
};

std::array<Item, 4> items(const facility_command_t& requested, const facility_state_t& shown) {
  return {{{"sun lamp", requested.sun_lamp, shown.sun_lamp, false},
           {"albedo lamp", requested.albedo_lamp, shown.albedo_lamp, false},
           {"azimuth", requested.sun_azimuth_rad, shown.sun_azimuth_rad, true},
           {"elevation", requested.sun_elevation_rad, shown.sun_elevation_rad, true}}};
}

}  // namespace

FacilityLink::FacilityLink(Actions& actions, Commander commander)
    : commander_(std::move(commander)),
      client_([&actions](const facility_command_t& command) { actions.send(command); }) {}

void FacilityLink::command(facility_command_t command, Utime now) {
  overtakes_ = unreached_;
  matched_ = false;
  unreached_ = true;
  client_.send(std::move(command), commander_, now);
}

void FacilityLink::on(const facility_state_t& state) {
  state_ = state;
  if (!unreached_ || state.utime < client_.command().utime) return;
  const bool matches = missing().empty();
  // Lamps on their way to an earlier request may pass the requested values.
  if (matches && (matched_ || !overtakes_)) unreached_ = false;
  matched_ = matches;
}

std::string FacilityLink::missing() const {
  if (!state_) return "the facility is silent";
  if (state_->valid == 0) return "the facility does not answer: " + state_->reason;
  std::string text;
  for (const Item& item : items(client_.command(), *state_)) {
    if (!item.reached()) text += (text.empty() ? "" : ", ") + item.text();
  }
  return text;
}

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
