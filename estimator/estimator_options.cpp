// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/estimator_options.h"

#include "common/core/config.h"

namespace berth::estimator {

namespace {

void read_model(Config config, ModelOptions& model) {
  config.optional("surface_samples", model.surface_samples, at_least(1000));
  config.optional("template_rotations", model.template_rotations, at_least(4));
  config.optional("template_voxels", model.template_voxels,
                  within(8, 48));  // a row of 64 leaves room for shifts
  config.optional("grid_voxels", model.grid_voxels, at_least(1000));
  config.optional("grid_margin", model.grid_margin, at_least(0));
  config.optional("region_radius", model.region_radius, at_least(0.005));
  config.optional("views", model.views, at_least(20));
  config.finish();
}

void read_gate(Config config, RangeGate& gate) {
  config.optional("near", Dimension::length, gate.near, at_least(0));
  config.optional("far", Dimension::length, gate.far);
  config.finish();
  if (!(gate.far > gate.near)) {
    throw config.error("far", "found a gate that holds nothing, expected far > near");
  }
}

void read_likelihood(Config config, LikelihoodOptions& likelihood) {
  config.optional("model_sigma", Dimension::length, likelihood.model_sigma_m);
  const ValueBounds share = above(0).below(0.9);
  config.optional("drop_out", likelihood.drop_out, share);
  config.optional("outlier", likelihood.outlier, share);
  config.optional("background", likelihood.background, share);
  config.optional("background_depth", Dimension::length, likelihood.background_depth_m,
                  at_least(0.1));
  config.finish();
}

void read_noise(Config config, NoiseOptions& noise) {
  config.optional("min", noise.min, above(0).at_most(1));
  config.optional("max", noise.max, at_least(1));
  config.finish();
}

void read_hypotheses(Config config, HypothesisAcquisitionOptions& h) {
  config.optional("risk", h.risk, above(0).below(0.5));
  config.optional("bare_surface_sigma", Dimension::length, h.bare_surface_sigma_m, at_least(0));
  config.optional("min_returns", h.min_returns, at_least(6));
  config.optional("max_hypotheses", h.max_hypotheses, at_least(1));
  config.finish();
}

void read_acquisition(Config config, EstimatorOptions& options) {
  options.acquisition_method = config.choice("method", acquisition_names());
  read_hypotheses(config.optional_section("hypotheses"), options.hypotheses);
  VoxelTemplateOptions& a = options.voxel_template;
  config.optional("beams", options.acquire_beams, at_least(10));
  config.optional("zoom_beams", options.zoom_beams, at_least(10));
  config.optional("min_elongation", a.min_elongation);
  config.optional("min_points", a.min_points, at_least(12));
  config.optional("point_sets", a.point_sets, at_least(1));
  config.optional("finalists_per_set", a.finalists_per_set, at_least(1));
  config.optional("decisive_margin", a.decisive_margin, at_least(0));
  config.optional("min_evidence", a.min_evidence);
  config.optional("min_explained", a.min_explained);
  config.optional("max_through", a.max_through);
  config.optional("min_inlier_share", a.min_inlier_share);
  config.optional("max_hypotheses", a.max_hypotheses, at_least(1));
  config.finish();
}

void read_icp(Config config, IcpOptions& icp) {
  config.optional_choice("registration", icp.registration,
                         {{"point_to_point", Registration::point_to_point},
                          {"point_to_plane", Registration::point_to_plane}});
  config.optional_choice("closest_points", icp.refine_closest_points,
                         {{"refined", true}, {"stored", false}});
  config.optional("iterations", icp.max_iterations, at_least(1));
  config.optional("start_gate", Dimension::length, icp.start_gate_m);
  config.optional("min_gate", Dimension::length, icp.min_gate_m, at_least(0.001));
  config.optional("gate_sigmas", icp.gate_sigmas);
  config.optional("stop_translation", Dimension::length, icp.stop_translation_m);
  config.optional("stop_rotation", Dimension::angle, icp.stop_rotation_rad);
  config.finish();
  if (!(icp.start_gate_m >= icp.min_gate_m)) {
    throw config.error("start_gate", "found less than 'min_gate', expected at least as much");
  }
}

void read_bounded_hough(Config config, BoundedHoughOptions& hough) {
  config.optional("voxel", hough.voxel, at_least(0.002));
  config.optional("levels", hough.levels, at_least(1));
  config.optional("reach", hough.reach, at_least(1));
  config.optional("kept", hough.kept, at_least(1));
  config.optional("max_points", hough.max_points, at_least(20));
  config.finish();
}

void read_tracking(Config config, EstimatorOptions& options) {
  options.tracking_method = config.choice("method", tracking_names());
  IcpTrackingOptions& t = options.icp_tracking;
  read_icp(config.optional_section("icp"), t.icp);
  read_bounded_hough(config.optional_section("bounded_hough"), options.bounded_hough);
  const std::string strategy = config.choice("strategy", scan_strategy_names());
  parse_scan_strategy(strategy, options.strategy);
  config.optional("returns_per_scan", options.returns_per_scan, at_least(10));
  config.optional("max_scan_time", Dimension::time, options.max_scan_time_s, at_least(0.01));
  config.optional("beam_steps", t.beam_steps);
  config.optional("deskew", t.deskew);
  config.optional("min_used", t.min_used, at_least(6));
  config.optional("min_inlier_share", t.min_inlier_share);
  config.optional("max_residual", Dimension::length, t.max_residual_m);
  config.optional("max_shift", Dimension::length, t.max_shift_m);
  config.optional("max_turn", Dimension::angle, t.max_turn_rad);
  config.optional("min_explained", t.min_explained);
  config.optional("max_through", t.max_through);
  config.optional("covariance_scale", t.covariance_scale, at_least(0.1));
  config.optional("floor_translation", Dimension::length, t.floor_m, at_least(1e-6));
  config.optional("floor_rotation", Dimension::angle, t.floor_rad, at_least(1e-6));
  config.optional("lost_after", options.lost_after, at_least(1));
  config.optional("reacquire", options.reacquire);
  config.optional("streaming", options.streaming);
  config.optional("estimate_every", options.estimate_every, at_least(1));
  config.optional("request_latency", Dimension::time, options.request_latency_s);
  config.finish();
  if (options.streaming && options.tracking_method != "likelihood") {
    throw config.error("method", "found '" + options.tracking_method +
                                     "', expected 'likelihood': only that measures pose and "
                                     "velocity by a part of a scan when tracking is streaming");
  }
}

void read_alpha_beta(Config config, AlphaBetaOptions& tracker) {
  config.optional("alpha", tracker.alpha, above(0).at_most(1));
  config.optional("beta", tracker.beta, at_least(0));
  config.optional("linear_acceleration", Dimension::acceleration, tracker.linear_acceleration);
  config.optional("angular_acceleration", Dimension::angular_acceleration,
                  tracker.angular_acceleration);
  config.finish();
  if (!(tracker.beta < 4 - 2 * tracker.alpha)) {
    throw config.error("beta",
                       "found a gain with which the filter is not stable, expected "
                       "beta < 4 - 2 alpha");
  }
}

void read_pose_filter(Config config, PoseFilterOptions& filter) {
  config.optional("linear_acceleration", Dimension::acceleration, filter.linear_acceleration,
                  at_least(1e-9));
  config.optional("angular_acceleration", Dimension::angular_acceleration,
                  filter.angular_acceleration, at_least(1e-9));
  config.optional("unknown_speed", Dimension::speed, filter.unknown_speed, at_least(1e-6));
  config.optional("unknown_rotation", Dimension::angular_speed, filter.unknown_rotation,
                  at_least(1e-6));
  config.optional("surprise_sigmas", filter.surprise_sigmas, at_least(1));
  config.finish();
}

void read_tracker(Config config, EstimatorOptions& options) {
  options.tracker_method = config.choice("method", tracker_names());
  read_alpha_beta(config.optional_section("alpha_beta"), options.alpha_beta);
  if (options.streaming && options.tracker_method != "se3") {
    throw config.error("method", "found '" + options.tracker_method +
                                     "', expected 'se3': only that can take in the few returns of "
                                     "each estimate when tracking is streaming");
  }
  read_pose_filter(config.optional_section("se3"), options.pose_filter);
  config.optional("inertial_motion", options.inertial_motion);
  config.finish();
  if (options.inertial_motion && options.tracker_method != "se3") {
    throw config.error("inertial_motion", "found true, which only the method 'se3' can take in");
  }
}

void read_planner(Config config, PlannerOptions& planner) {
  config.optional("max_windows", planner.max_windows, at_least(1));
  config.optional("margin_sigmas", planner.margin_sigmas, at_least(0.1));
  config.optional("min_margin", Dimension::length, planner.min_margin_m);
  config.optional("min_share_in_view", planner.min_share_in_view);
  config.optional("surface_share", planner.surface_share, above(0).below(1));
  config.optional("dense_factor", planner.dense_factor, at_least(1));
  config.optional("equal_share", planner.equal_share, within(0, 1));
  config.optional("spread_share", planner.spread_share, at_least(0).below(1));
  config.optional("view_cells", planner.view_cells, at_least(100));
  config.optional("min_cosine", planner.min_cosine, at_least(0));
  config.optional("design_tolerance", planner.design_tolerance, at_least(1e-4));
  config.finish();
}

void read_ranges(Config config, RangeOptions& ranges) {
  config.optional("medium_beams", ranges.medium_beams, at_least(5));
  config.optional("hysteresis", ranges.hysteresis, at_least(0).below(0.5));
  config.optional("axis_returns", ranges.axis_returns, at_least(10));
  config.optional("search_growth", ranges.search_growth, at_least(2));
  config.optional("docking_region", ranges.docking_share, at_least(0.01));
  config.optional("docking_port", ranges.docking_port);
  config.finish();
}

void read_budgets(Config config, Budgets& budgets) {
  config.optional_microseconds("track", budgets.track, above(0));
  config.optional_microseconds("acquire", budgets.acquire, above(0));
  config.optional_microseconds("model", budgets.model, above(0));
  config.finish();
}

}  // namespace

const std::vector<std::string>& acquisition_names() {
  static const std::vector<std::string> names = {"hypotheses", "voxel_template"};
  return names;
}

const std::vector<std::string>& tracking_names() {
  static const std::vector<std::string> names = {"likelihood", "icp", "bounded_hough"};
  return names;
}

const std::vector<std::string>& tracker_names() {
  static const std::vector<std::string> names = {"se3", "alpha_beta"};
  return names;
}

EstimatorOptions load_estimator_options(const std::filesystem::path& path) {
  Config config = Config::load(path);
  EstimatorOptions options;
  options.lidar = config.text("lidar");
  read_model(config.section("model"), options.model);
  read_gate(config.section("range_gate"), options.gate);
  read_likelihood(config.optional_section("likelihood"), options.voxel_template.likelihood);
  read_noise(config.optional_section("noise"), options.noise);
  options.icp_tracking.likelihood = options.voxel_template.likelihood;
  read_acquisition(config.section("acquisition"), options);
  read_tracking(config.section("tracking"), options);
  read_tracker(config.section("target_tracker"), options);
  read_planner(config.section("scan_planner"), options.planner);
  options.planner.bare_surface_sigma_m = options.hypotheses.bare_surface_sigma_m;
  options.likelihood_tracking.bare_surface_sigma_m = options.hypotheses.bare_surface_sigma_m;
  read_ranges(config.optional_section("ranges"), options.ranges);
  read_budgets(config.optional_section("budgets"), options.budgets);
  config.finish();
  return options;
}

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
