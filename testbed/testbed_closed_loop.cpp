// SPDX-License-Identifier: BSD-3-Clause
// Estimates in, guided set-points out.
#include "testbed/testbed_node.h"

namespace berth {

using namespace testbed;

namespace {

constexpr Utime instant_check_period = 200 * millisecond;

std::string status_name(std::int8_t status) {
  switch (status) {
    case pose_estimate_t::ACQUIRING:
      return "still being acquired";
    case pose_estimate_t::OK:
      return "good";
    case pose_estimate_t::AMBIGUOUS:
      return "ambiguous";
    case pose_estimate_t::LOST:
      return "lost";
    default:
      return "idle";
  }
}

}  // namespace

void TestbedNode::on_estimate(const pose_estimate_t& message) {
  if (message.session != session()) return;
  Estimate estimate;
  estimate.utime = message.utime;
  estimate.usable = message.status == pose_estimate_t::OK;
  estimate.status = status_name(message.status);
  if (!estimate.usable && !message.reason.empty()) estimate.status += " (" + message.reason + ")";
  estimate.pose = {
      Vector3d(message.position_m[0], message.position_m[1], message.position_m[2]),
      Quaterniond(message.q_wxyz[0], message.q_wxyz[1], message.q_wxyz[2], message.q_wxyz[3])};
  if (estimate.usable &&
      !(estimate.pose.position.allFinite() && std::abs(estimate.pose.rotation.norm() - 1) < 1e-3)) {
    estimate.usable = false;
    estimate.status = "not a pose";
  }
  // An attitude that may be anything leads nowhere: only the position is steered by.
  double variance = 0;
  for (int i = 3; i < 6; ++i) variance = std::max(variance, message.covariance[7 * i]);
  estimate.attitude_known =
      std::sqrt(variance) < 0.5 * settings_.guidance.largest_angular_correction;
  guidance_.on_estimate(estimate);
  look_at_estimate(message, estimate);
}

void TestbedNode::run_closed_loop(double dt) {
  guidance_.set_held(held_ || stopping_ || verdict_.level != Level::good);
  const Guidance::Output output = guidance_.step(now(), dt);
  std::string reason;
  const auto joints =
      task_.allocation->joints(output.commanded, output.progress, commanded_, &reason);
  if (!joints) return stop_arms("motion-failed", reason);
  if (largest_change(*joints, commanded_) > settings_.path.largest_step) {
    return stop_arms("motion-failed", "an arm would have to change its configuration");
  }
  // Where the estimate leads was not known when the path was checked.
  if (now() >= next_instant_check_) {
    next_instant_check_ = now() + instant_check_period;
    if (const auto wrong = check_.check(*joints)) return stop_arms("motion-failed", *wrong);
  }
  stream(*joints, settings_.setpoint_lifetime);
  trail_.add(*joints);
  if (stopping_) {
    if (guidance_.at_rest()) end_task(false);
    return;
  }
  const std::string before = guidance_reason_;
  guidance_reason_ = output.phase == Guidance::Phase::holding ? output.reason : "";
  if (before.empty() != guidance_reason_.empty()) {
    if (guidance_reason_.empty()) {
      event(event_t::NOTICE, "goes-on", "the estimate is good again");
    } else {
      event(event_t::WARNING, "holding", guidance_reason_);
    }
  }
  if (output.phase == Guidance::Phase::gave_up && !held_) {
    held_ = true;
    hold_reason_ = output.reason;
    event(event_t::ERROR, "gave-up", output.reason);
  }
  if (output.phase == Guidance::Phase::done) {
    if (!output.reason.empty()) event(event_t::WARNING, "not-settled", output.reason);
    end_task(true);
  }
}

}  // namespace berth
