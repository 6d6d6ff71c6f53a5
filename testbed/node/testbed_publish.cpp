// SPDX-License-Identifier: BSD-3-Clause
// Publishes GROUND_TRUTH, TESTBED_STATE, NODE_STATUS.
#include <berth/ground_truth_t.hpp>
#include <berth/guidance_state_t.hpp>

#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "testbed/node/testbed_node.h"

namespace berth {

using namespace testbed;

namespace {

constexpr int clearance_every = 5;  // states

}  // namespace

void TestbedNode::publish_truth(const Truth& truth) {
  estimate_watch_.on_truth(truth);
  ground_truth_t message{};
  message.utime = truth.utime;
  message.seq = ++truth_seq_;
  message.session = session();
  set_pose(truth.pose, message);
  set_velocity(truth.velocity, message);
  set_covariance(truth.covariance, message.covariance);
  message.basis = calibration_.basis;
  message.calibration_hash = calibration_.hash;
  bus().publish(channels::ground_truth, message);
}

void TestbedNode::publish_guidance(GuidanceReport report) {
  guidance_state_t state{};
  state.utime = now();
  state.seq = ++guidance_seq_;
  state.session = session();
  state.command_seq = task_.seq;
  state.profile = std::move(report.profile);
  state.law = std::move(report.law);
  state.phase = static_cast<std::int8_t>(report.phase);  // in the message's order
  state.reason = std::move(report.reason);
  state.length_scale = report.length_scale;
  state.time_scale = report.time_scale;
  state.orbit_time_s = report.orbit_time;
  state.range_m = report.range;
  state.closing_speed_m_s = report.closing_speed;
  state.wanted_closing_speed_m_s = report.reference_closing_speed;
  state.corridor_offset_m = report.corridor_offset;
  state.corridor_limit_m = report.corridor_limit;
  state.misalignment_rad = report.misalignment;
  state.hold_point = report.hold_point;
  Vector3d::Map(state.acceleration_orbit_m_s2) = report.acceleration_orbit;
  state.delta_v_orbit_m_s = report.delta_v_orbit;
  state.propellant_kg = report.propellant;
  bus().publish(channels::guidance_state, state);
}

/// Of a set-point in closed loop, from when it is carried out.
void TestbedNode::publish_chaser_motion(const Pose& commanded) {
  if (!settings_.publish_chaser_motion) return;
  auto message = chaser_motion_.add(now() + dead_time_, commanded);
  if (!message) return;
  message->seq = ++inertial_seq_;
  message->session = session();
  bus().publish(channels::inertial_motion, *message);
}

testbed_state_t TestbedNode::current_state() const {
  testbed_state_t state{};
  state.utime = now();
  state.session = session();
  if (verdict_.level == Level::fault) {
    state.state = testbed_state_t::FAULT;
    state.reason = verdict_.reason;
  } else if (mode_ != Mode::idle && held_) {
    state.state = testbed_state_t::HELD;
    state.reason = hold_reason_;
  } else if (mode_ != Mode::idle &&
             (verdict_.level != Level::good || paused_ || !guidance_reason_.empty())) {
    state.state = testbed_state_t::HOLDING;
    state.reason = verdict_.level != Level::good ? verdict_.reason
                   : paused_ ? "no partner is silent any more: going on in a moment"
                             : guidance_reason_;
  } else if (mode_ == Mode::idle) {
    state.state =
        verdict_.level == Level::good ? testbed_state_t::IDLE : testbed_state_t::NOT_READY;
    state.reason = verdict_.reason;
    if (planning_ && state.reason.empty()) {
      state.reason = "command " + std::to_string(planning_->command.seq) + " is being planned";
    }
  } else {
    state.state =
        mode_ == Mode::closed_loop ? testbed_state_t::CLOSED_LOOP : testbed_state_t::MOVING;
  }
  if (lease_.held(now())) {
    state.lease_holder = lease_.holder();
    state.lease_utime_expires = lease_.expires();
  }
  state.command_seq = command_seq_;
  state.finished_seq = finished_seq_;
  state.refused_seq = refused_seq_;
  state.refusal = refusal_;
  return state;
}

/// Periodically, and at once on changes for which a commander may wait.
void TestbedNode::publish_state(bool if_changed) {
  testbed_state_t state = current_state();
  if (if_changed && state.state == published_.state &&
      state.lease_holder == published_.lease_holder && override_ == published_.speed_override &&
      state.command_seq == published_.command_seq &&
      state.finished_seq == published_.finished_seq &&
      state.refused_seq == published_.refused_seq) {
    return;
  }
  state.seq = ++state_seq_;
  if (mode_ == Mode::closed_loop && task_.steering) {
    state.remaining_s = task_.steering->remaining() / rate();
    const double total = task_.time + task_.steering->remaining();
    state.progress = total > 0 ? task_.time / total : 0;
  } else if (mode_ == Mode::closed_loop) {
    state.progress = guidance_.progress();
    state.remaining_s = guidance_.remaining() / rate();
  } else if (task_.motion && task_.motion->duration() > 0) {
    state.progress = task_.time / task_.motion->duration();
    state.remaining_s = (task_.motion->duration() - task_.time) / rate();
  }
  state.speed_override = override_;
  if (!if_changed && --clearance_countdown_ < 0 && reported_valid_[0] && reported_valid_[1]) {
    clearance_countdown_ = clearance_every - 1;
    constexpr double beyond = 10;
    const double clearance = clearance_.min_distance(reported_, beyond);
    clearance_m_ = clearance < beyond ? clearance : -1;
  }
  state.clearance_m = clearance_m_;
  const auto age = guidance_.estimate_age(now());
  state.estimate_age_s = age ? seconds(*age) : -1;
  // Between two set-points it is on the way from one to the next.
  const double since = seconds(now() - last_tick_);
  set_pose(moved(relative(commanded_), commanded_velocity_, since), state.commanded_position_m,
           state.commanded_q_wxyz);
  Vector3d::Map(state.commanded_velocity_m_s) = commanded_velocity_.linear;
  Vector3d::Map(state.commanded_angular_velocity_rad_s) = commanded_velocity_.angular;
  published_ = state;
  bus().publish(channels::testbed_state, state);
  if (!if_changed && mode_ == Mode::closed_loop) {
    publish_guidance(task_.steering ? task_.steering->report() : guidance_.report());
  }
  count("truth_skipped", static_cast<double>(truth_.skipped()));
  switch (state.state) {
    case testbed_state_t::NOT_READY:
      return report(node_status_t::STARTING, state.reason);
    case testbed_state_t::FAULT:
      return report(node_status_t::FAULT, state.reason);
    case testbed_state_t::HOLDING:
    case testbed_state_t::HELD:
      return report(node_status_t::DEGRADED, state.reason);
    case testbed_state_t::IDLE:
      return report(node_status_t::READY);
    default:
      return report(node_status_t::RUNNING);
  }
}

}  // namespace berth
