// SPDX-License-Identifier: BSD-3-Clause
// The closed loop: estimates and external set-points in, guided poses out.
#include <cmath>

#include "common/core/text.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/good_estimate.h"
#include "testbed/guidance/external_guidance.h"
#include "testbed/node/testbed_node.h"

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
  estimate.dead_time = dead_time_;
  estimate.usable = message.status == pose_estimate_t::OK;
  estimate.status = status_name(message.status);
  if (!estimate.usable && !message.reason.empty()) estimate.status += " (" + message.reason + ")";
  estimate.pose = exact_pose_of(message);
  if (is_covariance(covariance_of(message.velocity_covariance))) {
    estimate.velocity = velocity_of(message);
  }
  if (const std::string defect = estimate_defect(message); estimate.usable && !defect.empty()) {
    estimate.usable = false;
    estimate.status = defect;
  }
  // With an uncertain attitude only the position is used for steering.
  double variance = 0;
  for (std::size_t i = 3; i < 6; ++i) variance = std::max(variance, message.covariance[7 * i]);
  estimate.attitude_known =
      std::sqrt(variance) < 0.5 * settings_.guidance.largest_angular_correction;
  guidance_.on_estimate(estimate);
  if (task_.steering) task_.steering->on_estimate(estimate);
  check_estimate(message, estimate);
}

/// May steer: the commander that the GUIDED command named, within its session and its time.
void TestbedNode::on_setpoint(const guidance_setpoint_t& setpoint) {
  const auto external = std::dynamic_pointer_cast<ExternalFlight>(task_.steering);
  std::string wrong;
  ExternalSetpoint obeyed{setpoint.utime_expires, velocity_of(setpoint)};
  if (setpoint.session != session()) {
    wrong = "belongs to session " + std::to_string(setpoint.session);
  } else if (!external) {
    return;  // no GUIDED command is under way
  } else if (setpoint.commander != external->commander()) {
    wrong = "is not from '" + external->commander() + "', which steers";
  } else if (now() > setpoint.utime_expires) {
    wrong = "came " + fixed(seconds(now() - setpoint.utime_expires), 1) + " s too late";
  } else if (!obeyed.velocity.linear.allFinite() || !obeyed.velocity.angular.allFinite()) {
    wrong = "has a velocity that is not a number";
  } else {
    refused_setpoint_.clear();
    return external->obey(obeyed);
  }
  count("setpoints_refused", ++setpoints_refused_);
  wrong = "a set-point of '" + setpoint.commander + "' " + wrong + " and moves nothing";
  if (setpoint.commander == refused_setpoint_) return;  // reported once
  refused_setpoint_ = setpoint.commander;
  event(event_t::WARNING, "setpoint-refused", wrong);
}

void TestbedNode::run_closed_loop(double dt) {
  const bool rest = held_ || stopping_ || verdict_.level != Level::good;
  scale_.set_target(rest ? 0 : rate());
  const double flown = scale_.advance(dt);
  task_.time += flown;
  Pose reference;
  double progress = 0;
  Steering::Phase phase = Steering::Phase::flying;
  std::string why;
  if (task_.steering) {
    Steering::Output output = task_.steering->step(now(), flown);
    reference = output.commanded;
    progress = output.progress;
    phase = output.phase;
    why = std::move(output.reason);
  } else {
    guidance_.set_held(rest);
    Guidance::Output output = guidance_.step(now(), dt);
    reference = output.commanded;
    progress = output.progress;
    why = std::move(output.reason);
    if (output.phase == Guidance::Phase::holding) phase = Steering::Phase::holding;
    if (output.phase == Guidance::Phase::done) phase = Steering::Phase::done;
    if (output.phase == Guidance::Phase::gave_up && !held_) {
      held_ = true;
      hold_reason_ = why;
      event(event_t::ERROR, "gave-up", why);
    }
  }
  publish_chaser_motion(reference);
  reference = reference * target_at(task_.target_motion, task_.time);
  const Velocity velocity =
      dt > 0 ? velocity_between(relative(commanded_), reference, dt) : Velocity{};
  std::string reason;
  const auto joints = task_.allocation->joints(reference, progress, commanded_, &reason);
  if (!joints) return stop_arms("motion-failed", reason);
  if (max_change(*joints, commanded_) > settings_.path.largest_step) {
    return stop_arms("motion-failed", "an arm would have to change its configuration");
  }
  // The path of the closed loop was unknown at the check before the start.
  if (now() >= next_instant_check_) {
    next_instant_check_ = now() + instant_check_period;
    if (const auto wrong = check_.check(*joints)) return stop_arms("motion-failed", *wrong);
    end_retreat_within_reach(reference, velocity, progress, *joints);
  }
  stream(*joints, settings_.setpoint_lifetime);
  trajectory_history_.add(*joints);
  follow_guidance(phase, why);
}

bool TestbedNode::retreats() const {
  return task_.steering && task_.steering->report().phase == GuidanceReport::Phase::retreating;
}

/// A retreat was not checked beforehand and may lead out of the cell: it is brought to rest before
/// the end of the arms' reach.
void TestbedNode::end_retreat_within_reach(const Pose& reference, const Velocity& velocity,
                                           double progress, const ArmPair& joints) {
  if (!retreats() || stopping_) return;
  const Pose ahead =
      moved(reference, velocity, settings_.hold_settling + seconds(instant_check_period));
  std::string beyond;
  const auto there = task_.allocation->joints(ahead, progress, joints, &beyond);
  if (there) beyond = check_.check(*there).value_or("");
  if (beyond.empty()) return;
  stopping_ = true;
  const std::string why = task_.steering->report().reason;
  abort_reason_ = "the approach was given up, and the chaser is as far back as the arms reach (" +
                  beyond + "): " + why;
  event(event_t::ERROR, "approach-aborted", why + "; the retreat ends early: " + beyond);
}

/// Acts on the phase of guidance: holding, done, or approach given up.
void TestbedNode::follow_guidance(Steering::Phase phase, const std::string& reason) {
  if (stopping_) {
    const bool at_rest = scale_.at_rest() && (task_.steering || guidance_.at_rest());
    if (at_rest && !waits_to_retreat()) end_task(task_.done);
    return;
  }
  const std::string before = guidance_reason_;
  guidance_reason_ = phase == Steering::Phase::holding ? reason : "";
  if (retreats() && !task_.given_up) {
    task_.given_up = true;
    event(event_t::WARNING, "retreat",
          "the approach is given up, the chaser backs off: " + task_.steering->report().reason);
  } else if (before.empty() != guidance_reason_.empty()) {
    if (guidance_reason_.empty()) {
      event(event_t::NOTICE, "goes-on", "guidance goes on");
    } else {
      event(event_t::WARNING, "holding", guidance_reason_);
    }
  }
  if (phase == Steering::Phase::done) {
    if (!reason.empty()) event(event_t::WARNING, "not-settled", reason);
    if (!task_.steering && !task_.target_motion) return end_task(true);
    task_.done = stopping_ = true;  // the target may be turning still
  }
  if (phase == Steering::Phase::aborted) {
    stopping_ = true;
    abort_reason_ = "the approach was given up, and the chaser is back from the target: " + reason;
    event(event_t::ERROR, "approach-aborted", reason);
  }
}

}  // namespace berth
