// SPDX-License-Identifier: BSD-3-Clause
// ARM_COMMAND in, registers out.
#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/core/text.h"
#include "drivers/arm/arm_node.h"
#include "drivers/arm/register_map.h"
#include "drivers/arm/report_evaluation.h"

namespace berth {
namespace {

constexpr Utime warning_repeat_period = second;
/// After this silence a writer of ARM_COMMAND may restart its sequence.
constexpr Utime writer_silence = second;

}  // namespace

void ArmNode::warn(const std::string& code, const std::string& text) {
  if (code == last_warning_ && now() - warned_at_ < warning_repeat_period) return;
  last_warning_ = code;
  warned_at_ = now();
  event(event_t::WARNING, code, name_ + ": " + text);
}

bool ArmNode::newer(const arm_command_t& command) {
  const bool writer_silent = now() - last_command_received_ > writer_silence;
  if (command.seq <= last_command_seq_ && !writer_silent) return false;
  last_command_seq_ = command.seq;
  last_command_received_ = now();
  return true;
}

void ArmNode::on_hold(const arm_command_t& command) {
  const bool known = !holds_.add({"", command.session, command.utime, command.seq});
  const bool at_rest = hold_requested_ && hold_written_ && state_.state != arm_state_t::RUNNING;
  if (known && (following_ || at_rest)) return;  // superseded by START, or carried out
  const bool own = command.session == session();
  if (!known) {
    const std::string unusual =
        unusual_stop(command, session(), now(), command.seq <= last_command_seq_);
    if (!unusual.empty()) warn("unusual-stop", "HOLD is obeyed, although it " + unusual);
    held_by_session_ = own ? std::nullopt : std::optional(command.session);
  }
  if (own) newer(command);
  hold();
}

void ArmNode::on_command(const arm_command_t& command) {
  if (command.action == arm_command_t::HOLD) return on_hold(command);
  if (command.session != session()) {
    return warn("command-of-another-session",
                "a command of session " + std::to_string(command.session) + " was ignored");
  }
  if (now() > command.utime_expires) {
    return warn("command-expired", "a command came " +
                                       std::to_string(now() - command.utime_expires) +
                                       " us after it had expired");
  }
  if (!newer(command)) return;
  switch (command.action) {
    case arm_command_t::STREAM:
      return stream(command);
    case arm_command_t::RESET:
      return adapter_->reset();
    case arm_command_t::START:
      return start();
    default:
      warn("command-unknown", "action " + std::to_string(command.action) + " is none");
  }
}

std::string ArmNode::jump(const arm_command_t& command) const {
  const double elapsed = seconds(now() - setpoint_received_);
  std::ostringstream text;
  for (std::size_t i = 0; i < 6; ++i) {
    const bool linear = arm_.kinematics->is_linear(static_cast<int>(i));
    double allowed = linear ? arm_.device.linear_guard : arm_.device.rotary_guard;
    if (streamed_) allowed += arm_.kinematics->limits()[i].speed * elapsed;
    const double step = command.joint[i] - order_.joints[i];
    if (!(std::abs(step) <= allowed)) {
      text << "set-point of joint " << i + 1 << " is " << fixed(pendant_from_si(step, linear), 2)
           << (linear ? " mm" : " deg") << " away from " << (streamed_ ? "the last one" : "the arm")
           << ", allowed are " << fixed(pendant_from_si(allowed, linear), 2);
      return text.str();
    }
  }
  Joints joints{};
  std::copy(std::begin(command.joint), std::end(command.joint), joints.begin());
  return arm_.kinematics->limit_violation(joints);
}

void ArmNode::stream(const arm_command_t& command) {
  if (!following_) {
    return warn("setpoint-without-start", "set-points are ignored until START");
  }
  const std::string wrong = jump(command);
  if (!wrong.empty()) return hold_by_itself("setpoint-refused", wrong);
  std::copy(std::begin(command.joint), std::end(command.joint), order_.joints.begin());
  order_.sequence = (order_.sequence + 1) % adapter_->capabilities().sequence_wrap;
  order_.speed_limit = std::clamp(command.speed_limit, 0.0, 1.0);
  order_.time = command.utime;
  setpoint_received_ = now();
  setpoint_expires_ = command.utime_expires;
  streamed_ = true;
}

void ArmNode::start() {
  if (following_) return;
  const bool can_start = state_.state == arm_state_t::IDLE || state_.state == arm_state_t::HELD ||
                         state_.state == arm_state_t::RUNNING;
  std::string reason;
  if (held_by_session_) {
    reason = "a command of session " + std::to_string(*held_by_session_) +
             " holds it, and the testbed has not answered with a HOLD of its own";
  } else if (!adapter_->takes_setpoints()) {
    reason = "there is no connection for set-points";
  } else if (!adapter_->ready() || !have_report_ || !state_.valid || !can_start) {
    reason = state_.reason.empty() ? "the controller is not ready" : state_.reason;
  }
  if (reason.empty()) reason = foreign_kinematics(report_, *arm_.kinematics);
  if (!reason.empty()) return warn("start-refused", "cannot start: " + reason);
  // The first set-point that the controller reads is the arm's present joints.
  order_.joints = report_.joints;
  order_.sequence = (order_.sequence + 1) % adapter_->capabilities().sequence_wrap;
  order_.follow = true;
  have_order_ = true;
  following_ = start_pending_ = true;
  start_pulsed_ = false;
  streamed_ = hold_requested_ = false;
  started_ = setpoint_received_ = now();
  order_.time = started_;
  adapter_->release();
  write_order();
}

void ArmNode::hold() {
  stop_following();
  hold_requested_ = true;
  hold_written_ = false;
  hold_repeated_ = now();
  hold_writes_under_way_ += adapter_->hold([this](const std::string& error) {
    --hold_writes_under_way_;
    hold_written_ = hold_written_ || error.empty();
    if (!error.empty()) warn("hold-not-taken", "HOLD is sent again: " + error);
  });
}

void ArmNode::hold_by_itself(const std::string& code, const std::string& text) {
  event(event_t::WARNING, code, name_ + " is held: " + text);
  hold();
}

void ArmNode::stop_following() {
  following_ = start_pending_ = streamed_ = false;
  order_.follow = false;
}

void ArmNode::write_setpoint() {
  const bool unconfirmed = hold_requested_ && !hold_written_ && hold_writes_under_way_ == 0;
  if (unconfirmed && adapter_->reachable()) hold();
  if (!adapter_->ready() || !have_report_) return;
  if (!have_order_) {
    if (!state_.valid) return;
    order_.joints = report_.joints;  // not followed yet: keeps the joints in the registers valid
    order_.sequence = report_.setpoint_taken;
    have_order_ = true;
  }
  if (following_ && streamed_ && now() > setpoint_expires_) {
    hold_by_itself("setpoints-stale", "set-points stopped coming");
  }
  write_order();
}

void ArmNode::write_order() {
  if (!adapter_->takes_setpoints()) return;
  if (adapter_->busy()) {
    ++writes_missed_;
    return;
  }
  adapter_->send(order_, [this, follow = order_.follow](const std::string& error) {
    if (!error.empty()) {
      ++writes_missed_;
      return;
    }
    ++statistics_.writes;
    // The controller may start once it has a set-point.
    if (start_pending_ && !start_pulsed_ && follow) {
      start_pulsed_ = true;
      adapter_->run();
    }
  });
}

}  // namespace berth
