// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "estimator/acquire/acquisition.h"
#include "estimator/acquire/hypothesis_acquisition.h"
#include "estimator/beam/noise_scale.h"
#include "estimator/filter/pose_filter.h"
#include "estimator/filter/target_tracker.h"
#include "estimator/plan/operating_range.h"
#include "estimator/plan/scan_planner.h"
#include "estimator/published/alpha_beta_tracker.h"
#include "estimator/published/bounded_hough.h"
#include "estimator/published/icp.h"
#include "estimator/published/voxel_template_acquisition.h"
#include "estimator/track/likelihood_tracking.h"
#include "estimator/track/tracking.h"

namespace berth::estimator {

/// How long the estimator may be at one input, us: a node that is at it longer is in FAULT.
struct Budgets {
  std::int64_t track = 1500000;     ///< while it tracks
  std::int64_t acquire = 10000000;  ///< otherwise
  std::int64_t model = 60000000;    ///< a command that chooses a model, which is compiled then
};

/// Everything that config/estimator.yaml says.
struct EstimatorOptions {
  std::string lidar = "ilris_3d";  ///< config/lidars/<lidar>.yaml
  ModelOptions model;
  RangeGate gate;  ///< unless a command gives one
  NoiseOptions noise;

  std::string acquisition_method = "hypotheses";
  VoxelTemplateOptions voxel_template;
  HypothesisAcquisitionOptions hypotheses;
  int acquire_beams = 6000;  ///< of a scan of the whole field of view
  int zoom_beams = 5000;     ///< of a scan of the place where the target seems to be

  std::string tracking_method = "likelihood";
  IcpTrackingOptions icp_tracking;
  BoundedHoughOptions bounded_hough;
  LikelihoodTrackingOptions likelihood_tracking;
  ScanStrategy strategy = ScanStrategy::information;
  int returns_per_scan = 1000;     ///< beams of a tracking scan, unless a command says how many,
  double max_scan_time_s = 0.5;    ///< or so many are longer than this
  int lost_after = 3;              ///< scans in a row without a pose
  bool reacquire = true;           ///< when lost, acquire again unasked
  double request_latency_s = 0.1;  ///< from the last beam of a scan to the first of the next

  bool streaming = false;   ///< estimates while a tracking scan runs
  int estimate_every = 50;  ///< returns, when streaming

  std::string tracker_method = "se3";
  bool inertial_motion = false;  ///< the chaser's own is taken in
  AlphaBetaOptions alpha_beta;
  PoseFilterOptions pose_filter;
  PlannerOptions planner;
  RangeOptions ranges;
  Budgets budgets;
};

/// What the options may name as methods.
const std::vector<std::string>& acquisition_names();
const std::vector<std::string>& tracking_names();
const std::vector<std::string>& tracker_names();

/// @throws InputError naming file, line and key.
EstimatorOptions load_estimator_options(const std::filesystem::path& path);

/// The methods that the options name. What is passed in must outlive what is made.
std::unique_ptr<Acquisition> make_acquisition(const EstimatorOptions& options,
                                              const TargetModel& model,
                                              const BeamModel& beam_model);
std::unique_ptr<Tracking> make_tracking(const EstimatorOptions& options, const TargetModel& model,
                                        const BeamModel& beam_model);
std::unique_ptr<TargetTracker> make_tracker(const EstimatorOptions& options);

}  // namespace berth::estimator
