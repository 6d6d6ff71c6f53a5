// SPDX-License-Identifier: BSD-3-Clause
// The arms' controllers are started; then the arms go back to where the path was left.
#include "testbed/motion/arm_name.h"
#include "testbed/node/testbed_node.h"

namespace berth {

using namespace testbed;

namespace {

constexpr Utime order_period = 250 * millisecond;

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
    const double away = largest_change(rejoin_from_, commanded_);
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

}  // namespace berth
