// SPDX-License-Identifier: BSD-3-Clause
// Stops of the arms, and their release.
#include "common/core/text.h"
#include "lcmtypes/conversions.h"
#include "testbed/motion/arm_pair.h"
#include "testbed/node/testbed_node.h"

namespace berth {

using namespace testbed;

namespace {

/// Time without a fault before the arms are started again.
constexpr Utime good_for = 500 * millisecond;
/// A HOLD can be lost on the way.
constexpr Utime hold_repeat_period = 50 * millisecond;
constexpr Utime look_ahead_period = 100 * millisecond;
/// s from a motion to the HOLD at its controller: report, set-point clock, wires, interpolation.
constexpr double reaction = 0.06;
/// m of approach that stops the arms: parting bodies may move. Above encoder noise.
constexpr double nearing = 2e-5;
/// Within which arms must be at rest after a HOLD.
constexpr Utime time_to_rest = second;

}  // namespace

void TestbedNode::supervise() {
  const bool closed_loop = mode_ != Mode::idle && task_.mode == Mode::closed_loop;
  const Verdict verdict = safety_.judge(now(), {engaged_, closed_loop});
  const bool changed = verdict.level != verdict_.level || verdict.code != verdict_.code;
  if (changed && verdict.level >= Level::hold) {
    const bool serious = verdict.level >= Level::held;
    if (!serious || engaged_ || mode_ == Mode::idle) {
      event(serious ? event_t::ERROR : event_t::WARNING, verdict.code, verdict.reason);
    }
  }
  if (changed && verdict.level == Level::good) {
    good_since_ = now();
    if (verdict_.level >= Level::hold) {
      event(event_t::NOTICE, "good-again", "the cell is as it should be again");
    }
  }
  verdict_ = verdict;
  if (!engaged_ && mode_ != Mode::starting) return;
  if (verdict_.level >= Level::held) {
    stop_arms("", verdict_.reason);
  } else if (verdict_.level != Level::good && mode_ != Mode::idle) {
    pause_arms();
  }
}

/// Both controllers stop at once; the operator has to RESUME.
void TestbedNode::stop_arms(const std::string& code, const std::string& reason) {
  leave_motion();
  if (!code.empty()) event(event_t::ERROR, code, reason);
  if (mode_ == Mode::idle) return;
  held_ = true;
  hold_reason_ = reason;
  if (waits_to_retreat()) {
    refuse(*after_stop_, reason);
    after_stop_.reset();
  }
  if (stopping_) end_task(false);
}

/// The same, but resumes when no partner is silent any more.
void TestbedNode::pause_arms() {
  leave_motion();
  paused_ = true;
  if (stopping_) end_task(false);
}

void TestbedNode::leave_motion() {
  order(arm_command_t::HOLD);
  hold_ordered_ = now();
  rest_.reset();
  engaged_ = false;
  rejoining_ = false;
  scale_.stop();
  guidance_.set_held(true);
  if (mode_ != Mode::idle) mode_ = task_.mode;
}

void TestbedNode::resume_when_good() {
  if (!paused_ || held_ || verdict_.level != Level::good || now() - good_since_ < good_for) return;
  event(event_t::NOTICE, "starts-again", "the arms are started again and go back to the path");
  begin_start();
}

/// A HOLD may be lost on the way: it is repeated until each controller reports that its arm is at
/// rest, and to a controller that is offline, whose state is unknown.
void TestbedNode::repeat_hold_until_at_rest() {
  if (engaged_ || mode_ == Mode::starting || hold_ordered_ == 0) return;
  const Utime since = now() - hold_ordered_;
  if (since < hold_repeat_period || since % hold_repeat_period >= settings_.setpoint_period) return;
  using State = SafetySupervisor::ArmState;
  for (const ArmRole role : both_arms) {
    const auto& arm = safety_.arm(role);
    if (!arm || arm->state == State::running || arm->state == State::offline) repeat_hold(role);
  }
}

bool TestbedNode::both_reported() const {
  for (const ArmRole role : both_arms) {
    const auto& arm = safety_.arm(role);
    if (!arm || now() - arm->received > settings_.safety.arm_silence) return false;
  }
  return true;
}

/// Clearance at the joints where the arms would come to rest if they were stopped now.
void TestbedNode::watch_clearance() {
  const Utime since = now() - clearance_checked_;
  if (since < look_ahead_period || !both_reported()) return;
  const ArmPair before = clearance_checked_from_;
  clearance_checked_ = now();
  clearance_checked_from_ = reported_;
  if (!engaged_ || since > 2 * look_ahead_period) return;
  const ArmPair ahead = stopping_place(cell_, before, reported_, seconds(since),
                                       reaction + seconds(look_ahead_period));
  const Clearance::Result there = clearance_.nearest(ahead, settings_.min_clearance);
  if (there.a.empty()) return;
  const double here = clearance_.min_distance(reported_, 1);
  if (there.distance > here - nearing) return;
  stop_arms("too-near", there.a + " and " + there.b + " come nearer than " +
                            fixed(1e3 * settings_.min_clearance, 0) + " mm: now " +
                            fixed(1e3 * here, 0) + " mm");
}

/// Detects an arm that moves after a HOLD, which this layer cannot stop.
void TestbedNode::watch_rest() {
  const bool at_rest = !engaged_ && mode_ != Mode::idle && mode_ != Mode::starting;
  if (!at_rest || now() - hold_ordered_ < time_to_rest || !both_reported()) return rest_.reset();
  if (!rest_) rest_ = reported_;
  for (const ArmRole role : both_arms) {
    if (max_change({rest_->of(role), {}}, {reported_.of(role), {}}) < rest_angle) continue;
    stop_arms(
        "arm-creeps",
        arm_name(role) + " moves although it was commanded to hold: press the emergency stop");
    return;
  }
}

void TestbedNode::check_report(ArmRole role, const arm_state_t& state) {
  ReportWatch::Report report;
  report.utime = state.utime;
  report.controller_time = state.controller_time_us;
  for (std::size_t i = 0; i < 6; ++i) {
    report.joints[i] = state.reported_joint[i];
    report.sigma[i] = state.reported_joint_sigma[i];
  }
  const auto wrong = report_watch_[role == ArmRole::replica ? 0 : 1].check(report);
  if (!wrong) return;
  if (mode_ != Mode::idle || engaged_) return stop_arms(wrong->code, wrong->text);
  event(event_t::WARNING, wrong->code, wrong->text);
}

void TestbedNode::check_estimate(const pose_estimate_t& message, const Estimate& estimate) {
  if (!estimate.usable) return estimate_watch_.forget();
  EstimateWatch::Position position;
  position.utime = estimate.utime;
  position.position = estimate.pose.position;
  position.covariance = covariance_of(message.covariance).topLeftCorner<3, 3>();
  const bool believed = !estimate_watch_.contradiction();
  estimate_watch_.on_estimate(position);
  const auto& wrong = estimate_watch_.contradiction();
  if (!wrong) return;
  const bool steers = mode_ != Mode::idle && task_.mode == Mode::closed_loop;
  if (steers && (engaged_ || mode_ == Mode::starting)) return stop_arms(wrong->code, wrong->text);
  if (believed) event(event_t::WARNING, wrong->code, wrong->text);
}

}  // namespace berth
