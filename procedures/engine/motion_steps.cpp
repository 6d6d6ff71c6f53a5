// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/motion_steps.h"

#include "common/core/text.h"
#include "lcmtypes/conversions.h"
#include "procedures/engine/step_runner.h"

namespace berth::procedures {

namespace {

/// Rates at which a closed loop turns, and at which it keeps a pose.
constexpr double turn = radians(5.0);
constexpr double keeping_speed = 0.05;

void set_waypoints(const testbed::Waypoints& waypoints, testbed_command2_t& command) {
  for (const auto& w : waypoints) {
    waypoint_t waypoint{};
    waypoint.time_s = w.time;
    set_pose(w.pose, waypoint);
    command.waypoints.push_back(waypoint);
  }
  command.waypoint_count = static_cast<std::int32_t>(command.waypoints.size());
}

/// The target's own motion begins in the frame that the model has at the start.
void set_target_motion(const std::optional<Trajectory>& motion, testbed_command2_t& command) {
  if (motion) set_waypoints(motion->waypoints(Pose{}), command);
}

struct Maker {
  const Pose& here;

  std::optional<testbed_command2_t> operator()(const Move& move) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::MOVE);
    set_pose(move.to, command);
    command.speed_m_s = move.speed;
    command.angular_speed_rad_s = move.angular_speed;
    command.frozen_arm = static_cast<std::int8_t>(move.frozen_arm);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Retreat& retreat) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::RETREAT);
    command.speed_m_s = retreat.speed;
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Trajectory& trajectory) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::TRAJECTORY);
    set_waypoints(trajectory.waypoints(here), command);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Approach& approach) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::APPROACH);
    command.standoff_m = approach.standoff;
    command.dock = approach.port ? 1 : 0;
    command.port = approach.port.value_or("");
    command.speed_m_s = approach.speed;
    command.angular_speed_rad_s = turn;
    command.guidance = approach.loop.guidance;
    set_target_motion(approach.loop.target_motion, command);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Hold& hold) const {
    if (!hold.closed_loop) return std::nullopt;
    testbed_command2_t command = testbed_command_of(testbed_command2_t::STATION_KEEP);
    set_pose(here, command);
    command.speed_m_s = keeping_speed;
    command.angular_speed_rad_s = turn;
    command.guidance = hold.loop.guidance;
    set_target_motion(hold.loop.target_motion, command);
    return command;
  }

  std::optional<testbed_command2_t> operator()(const Guided& guided) const {
    testbed_command2_t command = testbed_command_of(testbed_command2_t::GUIDED);
    command.speed_m_s = guided.speed;
    command.angular_speed_rad_s = guided.angular_speed;
    command.guidance = guided.by;
    set_target_motion(guided.target_motion, command);
    return command;
  }

  template <class Other>
  std::optional<testbed_command2_t> operator()(const Other&) const {
    return std::nullopt;
  }
};

}  // namespace

testbed_command2_t testbed_command_of(std::int8_t what) {
  testbed_command2_t command{};
  command.command = what;
  set_pose({}, command);
  return command;
}

std::optional<testbed_command2_t> motion_command(const Verb& verb, const Pose& here) {
  return std::visit(Maker{here}, verb);
}

namespace {

/// Where the replica is commanded to be (T_sensor_model).
Pose commanded_pose(const Bench& bench) {
  const auto& state = bench.testbed.state();
  if (!state) return {};
  return exact_pose_of(state->commanded_position_m, state->commanded_q_wxyz);
}

/// Everything the testbed carries out to an end: moves, retreats, trajectories, approaches.
class MotionRunner final : public StepRunner {
 public:
  explicit MotionRunner(Verb verb) : verb_(std::move(verb)) {}

  void begin(Bench& bench, Utime now) override {
    bench.testbed.command(*motion_command(verb_, commanded_pose(bench)), now);
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    const auto& state = bench.testbed.state();
    switch (bench.testbed.status()) {
      case CommandStatus::refused:
        detail_ = bench.testbed.refusal();
        return StepResult::error;
      case CommandStatus::finished:
        detail_.clear();
        return StepResult::passed;
      case CommandStatus::accepted:
        detail_ = fixed(100 * state->progress, 0) + " %";
        if (state->state == testbed_state_t::HOLDING && !state->reason.empty()) {
          detail_ = "holding: " + state->reason;
        }
        return StepResult::running;
      default:
        return StepResult::running;
    }
  }

 private:
  Verb verb_;
};

/// A closed loop without an end of its own: lasts for a time, or until a condition is met; then it
/// is stopped.
class StoppedRunner final : public StepRunner {
 public:
  StoppedRunner(Verb verb, double duration, std::optional<Condition> until)
      : verb_(std::move(verb)), duration_(duration), until_(std::move(until)) {}

  void begin(Bench& bench, Utime now) override {
    bench.testbed.command(*motion_command(verb_, commanded_pose(bench)), now);
  }

  StepResult poll(Bench& bench, Utime now, Utime active) override {
    const CommandStatus status = bench.testbed.status();
    if (status == CommandStatus::refused) {
      detail_ = bench.testbed.refusal();
      return StepResult::error;
    }
    if (!stopping_) {
      detail_ = fixed(seconds(active), 0) + " of " + fixed(duration_, 0) + " s";
      const auto& state = bench.testbed.state();
      if (state && state->state == testbed_state_t::HOLDING && !state->reason.empty()) {
        detail_ += ", holding: " + state->reason;
      }
      if (seconds(active) < duration_ && !is_met(bench, now)) return StepResult::running;
      stopping_ = true;
      bench.testbed.command(testbed_command_of(testbed_command2_t::STOP), now);
      return StepResult::running;
    }
    // Done at rest only: the next step may begin a motion.
    return status == CommandStatus::finished ? StepResult::passed : StepResult::running;
  }

 private:
  bool is_met(Bench& bench, Utime now) {
    std::string found;
    if (!until_ || !until_->met(bench.live, found)) {
      since_ = 0;
      return false;
    }
    if (since_ == 0) since_ = now;
    return seconds(now - since_) >= until_->duration;
  }

  Verb verb_;
  double duration_;
  std::optional<Condition> until_;
  Utime since_ = 0;
  bool stopping_ = false;
};

}  // namespace

std::unique_ptr<StepRunner> make(const Move& move) { return std::make_unique<MotionRunner>(move); }
std::unique_ptr<StepRunner> make(const Retreat& retreat) {
  return std::make_unique<MotionRunner>(retreat);
}
std::unique_ptr<StepRunner> make(const Trajectory& trajectory) {
  return std::make_unique<MotionRunner>(trajectory);
}
std::unique_ptr<StepRunner> make(const Approach& approach) {
  return std::make_unique<MotionRunner>(approach);
}
std::unique_ptr<StepRunner> make(const Hold& hold) {
  if (hold.closed_loop) return std::make_unique<StoppedRunner>(hold, hold.duration, std::nullopt);
  return make(Wait{hold.duration});
}
std::unique_ptr<StepRunner> make(const Guided& guided) {
  return std::make_unique<StoppedRunner>(guided, guided.duration, guided.until);
}

}  // namespace berth::procedures
