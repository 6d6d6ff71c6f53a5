// SPDX-License-Identifier: BSD-3-Clause
#include "lcmtypes/conversions.h"
#include "lcmtypes/good_estimate.h"
#include "procedures/engine/step_runner.h"

namespace berth::procedures {
namespace {

std::string why_not_good(const RunMessages& live) {
  const auto& estimate = live.estimate;
  if (!estimate) return "";
  const std::string why =
      estimate->status == pose_estimate_t::OK ? estimate_defect(*estimate) : estimate->reason;
  return why.empty() ? "" : ": " + why;
}

estimator_command_t command_of(std::int8_t what) {
  estimator_command_t command{};
  command.command = what;
  command.initial_q_wxyz[0] = 1;
  return command;
}

/// Acquire and track: done after some good estimates in a row that obey the command.
class TrackingRunner final : public StepRunner {
 public:
  TrackingRunner(estimator_command_t command, int settle)
      : command_(std::move(command)), settle_(settle) {}

  void begin(Bench& bench, Utime now) override { bench.estimator.command(command_, now); }

  void on_estimate(const Bench& bench, const pose_estimate_t& estimate) override {
    if (estimate.command_seq != bench.estimator.seq()) return;
    if (is_good(estimate)) {
      ++good_;
    } else {
      good_ = 0;
    }
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    if (bench.estimator.status() == CommandStatus::refused) {
      detail_ = "the estimator refuses: " + bench.estimator.refusal();
      return StepResult::error;
    }
    if (good_ >= settle_) {
      detail_.clear();
      return StepResult::passed;
    }
    detail_ = std::to_string(good_) + " of " + std::to_string(settle_) + " good estimates";
    detail_ += why_not_good(bench.live);
    return StepResult::running;
  }

 private:
  estimator_command_t command_;
  int settle_;
  int good_ = 0;
};

/// Orders that are done when they are accepted.
class StopTrackingRunner final : public StepRunner {
 public:
  void begin(Bench& bench, Utime now) override {
    bench.estimator.command(command_of(estimator_command_t::STOP), now);
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    if (bench.estimator.status() == CommandStatus::refused) {
      detail_ = "the estimator refuses: " + bench.estimator.refusal();
      return StepResult::error;
    }
    return bench.estimator.status() == CommandStatus::accepted ? StepResult::passed
                                                               : StepResult::running;
  }
};

class ScanRunner final : public StepRunner {
 public:
  explicit ScanRunner(const Scan& scan) : scan_(scan) {}

  void begin(Bench& bench, Utime now) override {
    estimator_command_t command = command_of(estimator_command_t::SCAN);
    command.window_count = 1;
    command.windows = messages_of({scan_.window});
    bench.estimator.command(command, now);
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    if (bench.estimator.status() == CommandStatus::refused) {
      detail_ = "the estimator refuses: " + bench.estimator.refusal();
      return StepResult::error;
    }
    const auto& lidar = bench.live.lidar;
    const bool done = lidar && lidar->scan_id >= bench.estimator.first_scan_id() &&
                      lidar->state == lidar_state_t::IDLE;
    if (!done) return StepResult::running;
    if (lidar->progress >= 1) return StepResult::passed;
    detail_ = "the scan was not made: " + lidar->reason;
    return StepResult::error;
  }

 private:
  Scan scan_;
};

/// At rest until so many good estimates came whose scans began at rest.
class DwellRunner final : public StepRunner {
 public:
  explicit DwellRunner(const Dwell& dwell) : dwell_(dwell) {}

  void begin(Bench&, Utime now) override { from_ = now + utime_from_seconds(dwell_.settle); }

  void on_estimate(const Bench&, const pose_estimate_t& estimate) override {
    const Utime begun =
        estimate.utime_first_return != 0 ? estimate.utime_first_return : estimate.utime;
    if (is_good(estimate) && begun >= from_) ++good_;
  }

  StepResult poll(Bench& bench, Utime, Utime) override {
    detail_ = std::to_string(good_) + " of " + std::to_string(dwell_.estimates) + " good estimates";
    if (good_ >= dwell_.estimates) return StepResult::passed;
    detail_ += why_not_good(bench.live);
    return StepResult::running;
  }

 private:
  Dwell dwell_;
  Utime from_ = 0;
  int good_ = 0;
};

}  // namespace

std::unique_ptr<StepRunner> make(const Acquire& acquire) {
  estimator_command_t command = command_of(estimator_command_t::ACQUIRE);
  command.gate_near_m = acquire.gate_near;
  command.gate_far_m = acquire.gate_far;
  command.returns_per_scan = acquire.returns;
  return std::make_unique<TrackingRunner>(command, 1);
}
std::unique_ptr<StepRunner> make(const Track& track) {
  estimator_command_t command = command_of(estimator_command_t::TRACK);
  command.gate_near_m = track.gate_near;
  command.gate_far_m = track.gate_far;
  command.strategy = track.strategy;
  command.returns_per_scan = track.returns;
  if (track.from) {
    command.has_initial_pose = 1;
    set_pose(*track.from, command.initial_position_m, command.initial_q_wxyz);
  }
  return std::make_unique<TrackingRunner>(command, track.settle);
}
std::unique_ptr<StepRunner> make(const Dwell& dwell) {
  return std::make_unique<DwellRunner>(dwell);
}
std::unique_ptr<StepRunner> make(const Scan& scan) { return std::make_unique<ScanRunner>(scan); }
std::unique_ptr<StepRunner> make(const StopTracking&) {
  return std::make_unique<StopTrackingRunner>();
}

}  // namespace berth::procedures
