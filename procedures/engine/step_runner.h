// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/pose_estimate_t.hpp>
#include <memory>
#include <string>

#include "procedures/engine/links.h"
#include "procedures/engine/live_quantity.h"
#include "procedures/language/procedure.h"

namespace berth::procedures {

/// The environment of a step.
struct Bench {
  Actions& actions;
  TestbedLink testbed;
  EstimatorLink estimator;
  FacilityLink facility;
  InjectionLink injections;
  RunMessages live;
};

enum class StepResult { running, passed, failed, error };

/// Carries out one step of a procedure.
class StepRunner {
 public:
  virtual ~StepRunner() = default;

  virtual void begin(Bench& bench, Utime now) = 0;
  /// Every message and every tick. @param active time since begin without the time on hold
  virtual StepResult poll(Bench& bench, Utime now, Utime active) = 0;
  /// The estimate that has just come.
  virtual void on_estimate(const Bench&, const pose_estimate_t&) {}

  /// The open question to the operator; nullptr: none.
  virtual const Prompt* prompt() const { return nullptr; }
  virtual void answer(const std::string&, const std::string& /*source*/) {}

  /// Progress, or why it failed.
  const std::string& detail() const { return detail_; }

 protected:
  std::string detail_;
};

/// The runner of each verb.
std::unique_ptr<StepRunner> make(const Lights& lights);
std::unique_ptr<StepRunner> make(const Move& move);
std::unique_ptr<StepRunner> make(const Retreat& retreat);
std::unique_ptr<StepRunner> make(const Trajectory& trajectory);
std::unique_ptr<StepRunner> make(const Acquire& acquire);
std::unique_ptr<StepRunner> make(const Track& track);
std::unique_ptr<StepRunner> make(const Approach& approach);
std::unique_ptr<StepRunner> make(const Hold& hold);
std::unique_ptr<StepRunner> make(const Guided& guided);
std::unique_ptr<StepRunner> make(const Wait& wait);
std::unique_ptr<StepRunner> make(const WaitUntil& wait);
std::unique_ptr<StepRunner> make(const Dwell& dwell);
std::unique_ptr<StepRunner> make(const Scan& scan);
std::unique_ptr<StepRunner> make(const Prompt& prompt);
std::unique_ptr<StepRunner> make(const Annotate& annotate);
std::unique_ptr<StepRunner> make(const Record& record);
std::unique_ptr<StepRunner> make(const Inject& inject);
std::unique_ptr<StepRunner> make(const ClearInjections& clear);
std::unique_ptr<StepRunner> make(const StopTracking& stop);

}  // namespace berth::procedures
