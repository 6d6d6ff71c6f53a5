// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/step_runner.h"

#include <berth/event_t.hpp>
#include <cstdio>

#include "procedures/engine/motion_command.h"

namespace berth::procedures {
namespace {

std::string fixed(double value, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

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
    if (!bench.facility.reached()) return StepResult::running;
    detail_ = "sun " + fixed(100 * lights_.sun, 0) + " %, albedo " +
              fixed(100 * lights_.albedo, 0) + " %";
    return StepResult::passed;
  }

 private:
  Lights lights_;
};

/// Everything the testbed carries out to an end: moves, trajectories, approaches.
class MotionRunner final : public StepRunner {
 public:
  explicit MotionRunner(testbed_command_t command) : command_(std::move(command)) {}

  void begin(Bench& bench, Utime now) override { bench.testbed.command(command_, now); }

  StepResult poll(Bench& bench, Utime, Utime) override {
    const auto& state = bench.testbed.state();
    switch (bench.testbed.answer()) {
      case Answer::refused:
        detail_ = "the testbed refuses: " + bench.testbed.refusal();
        return StepResult::error;
      case Answer::finished:
        detail_.clear();
        return StepResult::passed;
      case Answer::accepted:
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
  testbed_command_t command_;
};

/// Acquire and track: done after some good estimates in a row that obey the command.
class TrackingRunner final : public StepRunner {
 public:
  TrackingRunner(estimator_command_t command, int settle)
      : command_(std::move(command)), settle_(settle) {}

  void begin(Bench& bench, Utime now) override { bench.estimator.command(command_, now); }

  void on_estimate(const Bench& bench, const pose_estimate_t& estimate) override {
    if (estimate.command_seq != bench.estimator.seq()) return;
    if (estimate.status == pose_estimate_t::OK) {
      ++good_;
    } else {
      good_ = 0;
    }
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    if (bench.estimator.answer() == Answer::refused) {
      detail_ = "the estimator refuses: " + bench.estimator.refusal();
      return StepResult::error;
    }
    if (good_ >= settle_) {
      detail_.clear();
      return StepResult::passed;
    }
    detail_ = std::to_string(good_) + " of " + std::to_string(settle_) + " good estimates";
    if (bench.estimate && bench.estimate->status != pose_estimate_t::OK &&
        !bench.estimate->reason.empty()) {
      detail_ += ": " + bench.estimate->reason;
    }
    return StepResult::running;
  }

 private:
  estimator_command_t command_;
  int settle_;
  int good_ = 0;
};

estimator_command_t command_of(std::int8_t what) {
  estimator_command_t command{};
  command.command = what;
  command.initial_q_wxyz[0] = 1;
  return command;
}

/// Orders that are done when they are accepted.
class StopTrackingRunner final : public StepRunner {
 public:
  void begin(Bench& bench, Utime now) override {
    bench.estimator.command(command_of(estimator_command_t::STOP), now);
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    if (bench.estimator.answer() == Answer::refused) {
      detail_ = "the estimator refuses: " + bench.estimator.refusal();
      return StepResult::error;
    }
    return bench.estimator.answer() == Answer::accepted ? StepResult::passed : StepResult::running;
  }
};

class ScanRunner final : public StepRunner {
 public:
  explicit ScanRunner(const Scan& scan) : scan_(scan) {}

  void begin(Bench& bench, Utime now) override {
    estimator_command_t command = command_of(estimator_command_t::SCAN);
    command.window_count = 1;
    command.windows = {scan_.window};
    bench.estimator.command(command, now);
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    if (bench.estimator.answer() == Answer::refused) {
      detail_ = "the estimator refuses: " + bench.estimator.refusal();
      return StepResult::error;
    }
    const bool done = bench.lidar && bench.lidar->scan_id >= bench.estimator.first_scan_id() &&
                      bench.lidar->state == lidar_state_t::IDLE;
    return done ? StepResult::passed : StepResult::running;
  }

 private:
  Scan scan_;
};

class WaitRunner final : public StepRunner {
 public:
  explicit WaitRunner(double duration) : duration_(duration) {}

  void begin(Bench&, Utime) override {}

  StepResult poll(Bench&, Utime, Utime active) override {
    detail_ = fixed(seconds(active), 0) + " of " + fixed(duration_, 0) + " s";
    return seconds(active) >= duration_ ? StepResult::passed : StepResult::running;
  }

 private:
  double duration_;
};

/// Steers to keep the relative pose for a time, then stops.
class StationKeepRunner final : public StepRunner {
 public:
  explicit StationKeepRunner(const Hold& hold) : hold_(hold) {}

  void begin(Bench& bench, Utime now) override {
    Pose here;
    if (const auto& state = bench.testbed.state()) {
      const double* q = state->commanded_q_wxyz;
      here = {Vector3d::Map(state->commanded_position_m), Quaterniond(q[0], q[1], q[2], q[3])};
    }
    bench.testbed.command(*motion_command(hold_, here), now);
  }

  StepResult poll(Bench& bench, Utime now, Utime active) override {
    const Answer answer = bench.testbed.answer();
    if (answer == Answer::refused) {
      detail_ = "the testbed refuses: " + bench.testbed.refusal();
      return StepResult::error;
    }
    if (!stopping_) {
      detail_ = fixed(seconds(active), 0) + " of " + fixed(hold_.duration, 0) + " s";
      if (seconds(active) < hold_.duration) return StepResult::running;
      stopping_ = true;
      testbed_command_t command{};
      command.command = testbed_command_t::STOP;
      command.q_wxyz[0] = 1;
      bench.testbed.command(command, now);
      return StepResult::running;
    }
    return answer == Answer::pending ? StepResult::running : StepResult::passed;
  }

 private:
  Hold hold_;
  bool stopping_ = false;
};

class AnnotateRunner final : public StepRunner {
 public:
  explicit AnnotateRunner(std::string text) : text_(std::move(text)) {}

  void begin(Bench& bench, Utime) override {
    bench.actions.event(event_t::NOTICE, "annotation", text_);
  }
  StepResult poll(Bench&, Utime, Utime) override { return StepResult::passed; }

 private:
  std::string text_;
};

struct Maker {
  std::unique_ptr<StepRunner> operator()(const Lights& lights) const {
    return std::make_unique<LightsRunner>(lights);
  }
  std::unique_ptr<StepRunner> operator()(const Move& move) const {
    return std::make_unique<MotionRunner>(*motion_command(move, {}));
  }
  std::unique_ptr<StepRunner> operator()(const Trajectory& trajectory) const {
    return std::make_unique<MotionRunner>(*motion_command(trajectory, {}));
  }
  std::unique_ptr<StepRunner> operator()(const Approach& approach) const {
    return std::make_unique<MotionRunner>(*motion_command(approach, {}));
  }
  std::unique_ptr<StepRunner> operator()(const Acquire& acquire) const {
    estimator_command_t command = command_of(estimator_command_t::ACQUIRE);
    command.gate_near_m = acquire.gate_near;
    command.gate_far_m = acquire.gate_far;
    command.returns_per_scan = acquire.returns;
    return std::make_unique<TrackingRunner>(command, 1);
  }
  std::unique_ptr<StepRunner> operator()(const Track& track) const {
    estimator_command_t command = command_of(estimator_command_t::TRACK);
    command.gate_near_m = track.gate_near;
    command.gate_far_m = track.gate_far;
    command.strategy = track.strategy;
    command.returns_per_scan = track.returns;
    return std::make_unique<TrackingRunner>(command, track.settle);
  }
  std::unique_ptr<StepRunner> operator()(const Hold& hold) const {
    if (hold.closed_loop) return std::make_unique<StationKeepRunner>(hold);
    return std::make_unique<WaitRunner>(hold.duration);
  }
  std::unique_ptr<StepRunner> operator()(const Wait& wait) const {
    return std::make_unique<WaitRunner>(wait.duration);
  }
  std::unique_ptr<StepRunner> operator()(const Scan& scan) const {
    return std::make_unique<ScanRunner>(scan);
  }
  std::unique_ptr<StepRunner> operator()(const Annotate& annotate) const {
    return std::make_unique<AnnotateRunner>(annotate.text);
  }
  std::unique_ptr<StepRunner> operator()(const StopTracking&) const {
    return std::make_unique<StopTrackingRunner>();
  }
};

}  // namespace

std::unique_ptr<StepRunner> make_runner(const Step& step) { return std::visit(Maker{}, step.verb); }

}  // namespace berth::procedures
