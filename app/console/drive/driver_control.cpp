// SPDX-License-Identifier: BSD-3-Clause
// Who of the viewers has control: the engine publishes it while a procedure runs, else the
// testbed's lease does. A viewer that is still there keeps it from one to the other.
#include <berth/event_t.hpp>
#include <utility>

#include "app/console/drive/driver.h"
#include "procedures/engine/operator_control.h"

namespace berth::console {
namespace {

constexpr Utime request_again = second;
constexpr Utime time_for_lease = 3 * second;

/// Puts a viewer in the place of whoever had it.
void hand_over(Lease& lease, const std::string& viewer, Utime now) {
  if (!lease.held_by(viewer, now)) lease.release(lease.holder(), now);
  lease.take(viewer, now);
}

}  // namespace

Driver::Control Driver::control() const {
  const Utime now = loop_.now();
  const operator_control_t engine = procedure_.control();
  const bool runs = procedure_.active();
  const std::string ours = options_.name + " ";
  if (runs && !engine.holder.empty()) {
    const bool is_ours = engine.holder.rfind(ours, 0) == 0;
    return {engine.holder, is_ours ? engine.holder.substr(ours.size()) : "", engine.utime_expires,
            engine.holds_when_lost != 0};
  }
  if (lease_.held(now)) return {name_of(lease_.holder()), lease_.holder(), lease_.expires(), false};
  const std::string holder = cell_.lease_holder();
  if (runs || holder.rfind(ours, 0) == 0) return {};
  return {holder, "", cell_.testbed() && !holder.empty() ? cell_.testbed()->lease_utime_expires : 0,
          false};
}

void Driver::take_control(const Command& command) {
  const Control before = control();
  if (before.viewer == command.viewer) return answer(command, true, "you have control");
  if (procedure_.active()) return take_engine(command.viewer, answering(command));
  if (!before.holder.empty() && before.viewer.empty()) {
    return refuse(command, before.holder + " commands the testbed");
  }
  hand_over(lease_, command.viewer, loop_.now());
  host_.event(event_t::NOTICE, "control-taken",
              name_of(command.viewer) + (before.holder.empty()
                                             ? " has control"
                                             : " has taken control over from " + before.holder));
  follow_testbed();
  answer(command, true, "");
}

void Driver::take_engine(const std::string& viewer, ProcedureClient::Done done) {
  const std::string holder = procedure_.control().holder;
  procedure_command_t request{};
  request.command = procedure_command_t::TAKE_CONTROL;
  if (!holder.empty()) request.text = procedures::take_over_word;
  if (options_.hold_when_lost) {
    request.text +=
        (request.text.empty() ? "" : ", ") + std::string(procedures::hold_when_lost_word);
  }
  engine_requested_ = loop_.now();
  send(viewer, request,
       [this, viewer, done = std::move(done)](CommandStatus status, const std::string& reason) {
         if (status == CommandStatus::accepted) hand_over(lease_, viewer, loop_.now());
         if (done) done(status, reason);
       });
}

void Driver::keep_control(const Command& command) {
  hand_over(lease_, command.viewer, loop_.now());
  if (procedure_.active()) procedure_.keep_control(name_of(command.viewer));
  answer(command, true, "");
}

void Driver::release_control(const Command& command) {
  lease_.release(command.viewer, loop_.now());
  if (procedure_.active() && !procedure_.control().holder.empty()) {
    return request(command, procedure_command_t::RELEASE_CONTROL);
  }
  cell_.give_back();
  host_.event(event_t::NOTICE, "control-released", "nobody has control");
  answer(command, true, "");
}

void Driver::tick() {
  cell_.tick();
  if (procedure_.active()) {
    follow_engine();
  } else {
    follow_testbed();
  }
}

/// The engine needs the testbed's lease, and knows itself when its operator is lost. Whoever had
/// control of the cell has that of the procedure that begins.
void Driver::follow_engine() {
  const Utime now = loop_.now();
  cell_.give_back();
  lease_.lapse(now);
  if (!std::exchange(follows_engine_, true)) inherits_ = true;
  const std::string holder = procedure_.control().holder;
  inherits_ = inherits_ && holder.empty() && lease_.held(now);
  if (!lease_.held(now) || holder == name_of(lease_.holder())) return;
  if (!inherits_) {
    lease_.release(lease_.holder(), now);
  } else if (now - engine_requested_ >= request_again) {
    take_engine(lease_.holder(), {});
  }
}

void Driver::follow_testbed() {
  const Utime now = loop_.now();
  follows_engine_ = false;
  const std::string lost = lease_.holder();
  if (lease_.lapse(now)) {
    host_.event(event_t::WARNING, "control-lapsed",
                name_of(lost) + " is no longer heard: nobody has control");
  }
  if (!lease_.held(now)) return cell_.give_back();
  const std::string name = name_of(lease_.holder());
  if (cell_.taken_for() != name) {
    cell_.take(name);
    lease_requested_ = now;
  } else if (!cell_.has_lease() && now - lease_requested_ > time_for_lease) {
    const std::string other = cell_.lease_holder();
    host_.event(
        event_t::WARNING, "control-lapsed",
        name + " has no control: " +
            (other.empty() ? "the testbed gives no lease" : other + " commands the testbed"));
    lease_.release(lease_.holder(), now);
    cell_.give_back();
  }
}

}  // namespace berth::console
