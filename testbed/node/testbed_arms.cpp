// SPDX-License-Identifier: BSD-3-Clause
// The arms: what their controllers report, how they are started and brought back to the path.
#include <cmath>

#include "common/core/text.h"
#include "lcmtypes/channels.h"
#include "testbed/motion/arm_pair.h"
#include "testbed/node/testbed_node.h"

namespace berth {

using namespace testbed;

namespace {

constexpr Utime order_period = 250 * millisecond;

/// us between the min and the max believable dead time for it to be known.
constexpr Utime dead_time_known = 40 * millisecond;
/// us of difference from the nominal one that raises a warning: 5 mm at 100 mm/s.
constexpr Utime dead_time_off = 50 * millisecond;
/// us, change of the dead time from which a new value is used and published: 0.1 mm at 50 mm/s.
constexpr Utime min_dead_time_change = 2 * millisecond;

SafetySupervisor::ArmState arm_state_of(std::int8_t state) {
  using State = SafetySupervisor::ArmState;
  switch (state) {
    case arm_state_t::IDLE:
      return State::idle;
    case arm_state_t::RUNNING:
      return State::running;
    case arm_state_t::HELD:
      return State::held;
    case arm_state_t::FAULT:
      return State::fault;
    case arm_state_t::ESTOP:
      return State::estop;
    default:
      return State::offline;
  }
}

/// Of utime, s. utime comes from the controller's clock; of a driver without one, the joints were
/// read at an unknown time between sending and receiving.
double time_sigma_of(const arm_state_t& state) {
  if (state.clock_offset_sigma_s > 0) return state.clock_offset_sigma_s;
  return seconds(state.utime_received - state.utime_sent) / std::sqrt(12.0);
}

}  // namespace

void TestbedNode::begin_start() {
  mode_ = Mode::starting;
  start_begun_ = now();
  order_sent_ = 0;
  rejoining_ = paused_ = false;
}

void TestbedNode::run_start(double dt) {
  const Utime t = now();
  if (stopping_) return end_task(false);
  if (held_ && rejoining_) return stop_arms("", hold_reason_);
  if (held_) return;
  if (!rejoining_) {
    bool running = true;
    for (const ArmRole role : both_arms) {
      const auto& arm = safety_.arm(role);
      running = running && arm && arm->state == SafetySupervisor::ArmState::running;
    }
    if (!running || order_sent_ == 0 || t - order_sent_ < order_period / 2) {
      if (t - start_begun_ > settings_.start_time_limit) {
        std::string reason = "the arms' controllers did not start";
        for (const ArmRole role : both_arms) {
          const auto& arm = safety_.arm(role);
          if (arm && !arm->reason.empty()) reason += "; " + arm_name(role) + ": " + arm->reason;
        }
        stop_arms("start-failed", reason);
      } else if (order_sent_ == 0 || (!running && t - order_sent_ >= order_period)) {
        // Named before it: the HOLD that it supersedes, whose repetitions are duplicates then.
        if (hold_ordered_ != 0) {
          for (const ArmRole role : both_arms) repeat_hold(role);
        }
        order(arm_command_t::START);
        order_sent_ = t;
      }
      return;
    }
    rejoining_ = true;
    rejoin_from_ = reported_;
    rejoin_time_ = 0;
    const double away = max_change(rejoin_from_, commanded_);
    rejoin_ = SmoothTravel(away, settings_.rejoin_speed, settings_.rejoin_speed,
                           4 * settings_.rejoin_speed);
    engaged_ = true;
    command_history_.clear();
    for (FollowingWatch& watch : following_watch_) watch.begin();
  }
  rejoin_time_ += dt;
  const double s = rejoin_.length() > 0 ? rejoin_.position(rejoin_time_) / rejoin_.length() : 1.0;
  stream(blend(rejoin_from_, commanded_, s), settings_.setpoint_lifetime);
  if (rejoin_time_ < rejoin_.duration()) return;
  rejoining_ = false;
  mode_ = task_.mode;
  guidance_.set_held(held_);
}

void TestbedNode::on_arm_state(ArmRole role, const arm_state_t& state) {
  if (state.session != session()) return;
  safety_.on_arm(role, {now(), state.valid != 0, arm_state_of(state.state), state.reason});
  reported_valid_[role == ArmRole::replica ? 0 : 1] = state.valid != 0;
  if (state.valid == 0) return;
  on_controller_override(role, state.speed_override);
  check_report(role, state);
  JointSample sample;
  sample.utime = state.utime + utime_from_seconds(calibration_.arm_time(role));
  for (std::size_t i = 0; i < 6; ++i) {
    sample.joints[i] = state.reported_joint[i];
    sample.sigma[i] = state.reported_joint_sigma[i];
  }
  sample.time_sigma = time_sigma_of(state);
  reported_.of(role) = sample.joints;
  truth_.add(role, sample);

  if (!engaged_) return;
  FollowingWatch& watch = following_watch_[role == ArmRole::replica ? 0 : 1];
  const auto deviation =
      watch.check(state.utime, sample.time_sigma, sample.joints, command_history_);
  if (deviation) stop_arms(deviation->code, deviation->text);
  learn_dead_time();
}

/// Mean dead time of the arms whose motion has determined it; until then the nominal one, or the
/// one before the controllers were restarted.
void TestbedNode::learn_dead_time() {
  double sum = 0;
  int known = 0;
  for (const ArmRole role : both_arms) {
    const auto& found = following_watch_[role == ArmRole::replica ? 0 : 1].dead_time();
    if (found.max - found.min > dead_time_known) continue;
    count("dead_time_" + std::string(name_of(role)) + "_ms", 1e3 * seconds(found.best));
    sum += static_cast<double>(found.best);
    ++known;
  }
  if (known == 0) return;
  const auto both = static_cast<Utime>(std::llround(sum / known));
  if (latency_.seq > 0 && std::abs(both - dead_time_) < min_dead_time_change) return;
  const bool warn = latency_.seq == 0 && std::abs(both - settings_.dead_time) >= dead_time_off;
  dead_time_ = both;
  latency_.latency_s = seconds(both);
  latency_.nominal_s = seconds(settings_.dead_time);
  publish_latency();
  event(warn ? event_t::WARNING : event_t::INFO, "dead-time",
        "a dead time of " + fixed(1e3 * seconds(both), 1) +
            " ms is reckoned with: so long after its set-points " +
            (known > 1 ? "an arm moves, in the mean of both" : "the arm moves that was moved") +
            "; testbed.yaml has " + fixed(1e3 * seconds(settings_.dead_time), 0) + " ms");
}

void TestbedNode::publish_latency() {
  latency_.utime = now();
  ++latency_.seq;
  latency_.session = session();
  bus().publish(channels::setpoint_latency, latency_);
}

void TestbedNode::on_facility(const facility_state_t& state) {
  if (state.session != session()) return;
  safety_.on_facility(now(), state.valid, state.estop_chain_closed, state.fence_closed,
                      state.motion_enabled, state.reason);
}

}  // namespace berth
