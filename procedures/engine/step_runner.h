// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/lidar_state_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <memory>
#include <optional>
#include <string>

#include "procedures/engine/estimator_link.h"
#include "procedures/engine/facility_link.h"
#include "procedures/engine/testbed_link.h"
#include "procedures/language/procedure.h"

namespace berth::procedures {

/// What a step works with.
struct Bench {
  Actions& actions;
  TestbedLink testbed;
  EstimatorLink estimator;
  FacilityLink facility;
  std::optional<pose_estimate_t> estimate;  ///< the latest
  std::optional<lidar_state_t> lidar;       ///< the latest
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

  /// Progress, or why it failed.
  const std::string& detail() const { return detail_; }

 protected:
  std::string detail_;
};

std::unique_ptr<StepRunner> make_runner(const Step& step);

}  // namespace berth::procedures
