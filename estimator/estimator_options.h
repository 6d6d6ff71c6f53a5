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

/// Maximum processing time of one input, us; a node that exceeds it is in FAULT.
struct Budgets {
  std::int64_t track = 1500000;     ///< while tracking
  std::int64_t acquire = 10000000;  ///< otherwise
  std::int64_t model = 60000000;    ///< a command that chooses a model, which is compiled then
};

/// The contents of config/estimator.yaml.
struct EstimatorOptions {
  std::string lidar = "ilris_3d";  ///< config/lidars/<lidar>.yaml
  ModelOptions model;
  RangeGate gate;  ///< default of commands
  NoiseOptions noise;

  std::string acquisition_method = "hypotheses";
  VoxelTemplateOptions voxel_template;
  HypothesisAcquisitionOptions hypotheses;
  int acquire_beams = 6000;  ///< of a scan of the whole field of view
  int zoom_beams = 5000;     ///< of a scan about a hypothesis

  std::string tracking_method = "likelihood";
  IcpTrackingOptions icp_tracking;
  BoundedHoughOptions bounded_hough;
  LikelihoodTrackingOptions likelihood_tracking;
  ScanStrategy strategy = ScanStrategy::information;
  int returns_per_scan = 1000;     ///< default number of beams of a tracking scan
  double max_scan_time_s = 0.5;    ///< limits that default
  int lost_after = 3;              ///< consecutive scans without a pose
  bool reacquire = true;           ///< acquire again when lost, without a command
  double request_latency_s = 0.1;  ///< from the last beam of a scan to the first of the next

  bool streaming = false;   ///< estimates during a tracking scan
  int estimate_every = 50;  ///< returns, when streaming

  std::string tracker_method = "se3";
  bool inertial_motion = false;  ///< the chaser's inertial motion is an input of the tracker
  AlphaBetaOptions alpha_beta;
  PoseFilterOptions pose_filter;
  PlannerOptions planner;
  RangeOptions ranges;
  Budgets budgets;
};

/// Names of methods in the options.
const std::vector<std::string>& acquisition_names();
const std::vector<std::string>& tracking_names();
const std::vector<std::string>& tracker_names();

/// @throws InputError naming file, line and key.
EstimatorOptions load_estimator_options(const std::filesystem::path& path);

/// The methods that the options name. Arguments must outlive the result.
std::unique_ptr<Acquisition> make_acquisition(const EstimatorOptions& options,
                                              const TargetModel& model,
                                              const BeamModel& beam_model);
std::unique_ptr<Tracking> make_tracking(const EstimatorOptions& options, const TargetModel& model,
                                        const BeamModel& beam_model);
std::unique_ptr<TargetTracker> make_tracker(const EstimatorOptions& options);

}  // namespace berth::estimator
