// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/text.h"
#include "procedures/engine/step_runner.h"

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

class InjectionRunner final : public StepRunner {
 public:
  InjectionRunner(injection_t injection, Utime after)
      : injection_(std::move(injection)), after_(after) {}

  void begin(Bench& bench, Utime now) override {
    // Nothing to clear, also without a simulated cell.
    idle_ = injection_.action != injection_t::INJECT && !bench.injections.used();
    if (idle_) return;
    if (after_ > 0) return bench.injections.command_later(injection_, now + after_);
    bench.injections.command(injection_, now);
  }

  StepResult poll(Bench& bench, Utime, Utime active) override {
    constexpr Utime patience = 5 * second;  // the simulated cell publishes its state every second
    if (after_ > 0) {
      detail_ = "in " + fixed(seconds(after_), 1) + " s";
      return StepResult::passed;
    }
    if (idle_ || bench.injections.status() == CommandStatus::accepted) {
      detail_.clear();
      return StepResult::passed;
    }
    if (bench.injections.status() == CommandStatus::refused) {
      detail_ = "the simulated cell refuses: " + bench.injections.refusal();
      return StepResult::error;
    }
    if (!bench.injections.state() && active > patience) {
      detail_ = "no simulated cell answers, and only a simulated cell can be injected";
      return StepResult::error;
    }
    return StepResult::running;
  }

 private:
  injection_t injection_;
  Utime after_;
  bool idle_ = false;
};

}  // namespace

std::unique_ptr<StepRunner> make(const Lights& lights) {
  return std::make_unique<LightsRunner>(lights);
}

std::unique_ptr<StepRunner> make(const Inject& inject) {
  injection_t injection{};
  injection.action = injection_t::INJECT;
  injection.device = inject.device;
  injection.fault = inject.fault;
  injection.value = inject.value;
  injection.duration_s = inject.duration;
  return std::make_unique<InjectionRunner>(injection, utime_from_seconds(inject.after));
}

std::unique_ptr<StepRunner> make(const ClearInjections& clear) {
  injection_t injection{};
  injection.action = clear.device.empty() ? injection_t::CLEAR_ALL : injection_t::CLEAR;
  injection.device = clear.device;
  injection.fault = clear.fault;
  return std::make_unique<InjectionRunner>(injection, 0);
}

}  // namespace berth::procedures
