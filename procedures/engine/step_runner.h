// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/pose_estimate_t.hpp>
#include <memory>
#include <string>

#include "procedures/engine/estimator_link.h"
#include "procedures/engine/facility_link.h"
#include "procedures/engine/injection_link.h"
#include "procedures/engine/latest_messages.h"
#include "procedures/engine/testbed_link.h"
#include "procedures/language/procedure.h"

namespace berth::procedures {

/// What a step works with.
struct Bench {
  Actions& actions;
  TestbedLink testbed;
  EstimatorLink estimator;
  FacilityLink facility;
  InjectionLink injections;
  LatestMessages live;
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

  /// The question to the operator now; nullptr when nothing.
  virtual const Prompt* prompt() const { return nullptr; }
  virtual void answer(const std::string&, const std::string& /*who*/) {}

  /// Progress, or why it failed.
  const std::string& detail() const { return detail_; }

 protected:
  std::string detail_;
};

std::unique_ptr<StepRunner> make_runner(const Step& step);

}  // namespace berth::procedures
