// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/text.h"
#include "lcmtypes/conversions.h"
#include "procedures/engine/motion_command.h"
#include "procedures/engine/step_makers.h"

namespace berth::procedures {
namespace {

class LightsRunner final : public StepRunner {
 public:
  explicit LightsRunner(const Lights& lights) : lights_(lights) {}

  void begin(Bench& bench, Utime now) override {
    facility_command_t command{};
    command.sun_lamp = lights_.sun;
    command.albedo_lamp = lights_.albedo;
    command.sun_azimuth_rad = lights_.sun_azimuth;
    command.sun_elevation_rad = lights_.sun_elevation;
    bench.facility.command(command, now);
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    if (bench.facility.status() == CommandStatus::refused) {
      detail_ = "the facility refuses: " + bench.facility.refusal();
      return StepResult::error;
    }
    if (!bench.facility.reached()) {
      detail_ = bench.facility.missing();
      return StepResult::running;
    }
    detail_ = "sun " + fixed(100 * lights_.sun, 0) + " %, albedo " +
              fixed(100 * lights_.albedo, 0) + " %";
    return StepResult::passed;
  }

 private:
  Lights lights_;
};

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
    // At rest, not only on the way there: the next step may want to move.
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

std::unique_ptr<StepRunner> make(const Lights& lights) {
  return std::make_unique<LightsRunner>(lights);
}
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
