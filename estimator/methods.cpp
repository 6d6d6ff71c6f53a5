// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/methods.h"

namespace berth::estimator {

std::unique_ptr<Acquisition> make_acquisition(const EstimatorOptions& options,
                                              const TargetModel& model,
                                              const BeamModel& beam_model) {
  if (options.acquisition_method == "hypotheses") {
    return std::make_unique<HypothesisAcquisition>(model, beam_model, options.hypotheses);
  }
  return std::make_unique<VoxelTemplateAcquisition>(model, beam_model, options.voxel_template);
}

std::unique_ptr<Tracking> make_tracking(const EstimatorOptions& options, const TargetModel& model,
                                        const BeamModel& beam_model) {
  if (options.tracking_method == "bounded_hough") {
    return std::make_unique<BoundedHoughTracking>(model, beam_model, options.bounded_hough,
                                                  options.icp_tracking);
  }
  if (options.tracking_method == "likelihood") {
    return std::make_unique<LikelihoodTracking>(model, beam_model, options.likelihood_tracking);
  }
  return std::make_unique<IcpTracking>(model, beam_model, options.icp_tracking);
}

std::unique_ptr<TargetTracker> make_tracker(const EstimatorOptions& options) {
  if (options.tracker_method == "se3") return std::make_unique<PoseFilter>(options.pose_filter);
  return std::make_unique<AlphaBetaTracker>(options.alpha_beta);
}

}  // namespace berth::estimator
