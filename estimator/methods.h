// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "estimator/acquire/acquisition.h"
#include "estimator/estimator_options.h"
#include "estimator/filter/target_tracker.h"
#include "estimator/track/tracking.h"

namespace berth::estimator {

/// The methods that the options name. What is passed in must outlive what is made.
std::unique_ptr<Acquisition> make_acquisition(const EstimatorOptions& options,
                                              const TargetModel& model,
                                              const BeamModel& beam_model);
std::unique_ptr<Tracking> make_tracking(const EstimatorOptions& options, const TargetModel& model,
                                        const BeamModel& beam_model);
std::unique_ptr<TargetTracker> make_tracker(const EstimatorOptions& options);

}  // namespace berth::estimator
