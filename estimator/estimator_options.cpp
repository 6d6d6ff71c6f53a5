// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/estimator_options.h"

#include <cmath>

#include "common/core/config.h"
#include "common/core/positive.h"

namespace berth::estimator {

namespace {

void at_least(const Config& config, const std::string& key, double value, double least) {
  if (!(value >= least)) {
    throw config.error(
        key, "found a value that is too small, expected at least " + std::to_string(least));
  }
}

void read_model(Config config, ModelOptions& model) {
  config.optional("surface_samples", model.surface_samples);
  config.optional("template_rotations", model.template_rotations);
  config.optional("template_voxels", model.template_voxels);
  config.optional("grid_voxels", model.grid_voxels);
  config.optional("grid_margin", model.grid_margin);
  config.optional("region_radius", model.region_radius);
  config.optional("views", model.views);
  config.finish();
  at_least(config, "surface_samples", model.surface_samples, 1000);
  at_least(config, "template_rotations", model.template_rotations, 4);
  at_least(config, "template_voxels", model.template_voxels, 8);
  if (model.template_voxels > 48) {
    throw config.error("template_voxels", "found more than 48: a row of 64 leaves room for shifts");
  }
  at_least(config, "grid_voxels", model.grid_voxels, 1000);
  at_least(config, "grid_margin", model.grid_margin, 0);
  at_least(config, "region_radius", model.region_radius, 0.005);
  at_least(config, "views", model.views, 20);
}

void read_gate(Config config, RangeGate& gate) {
  config.optional("near", Dimension::length, gate.near);
  config.optional("far", Dimension::length, gate.far);
  config.finish();
  if (!(gate.near >= 0 && gate.far > gate.near)) {
    throw config.error("far", "found a gate that holds nothing, expected far > near >= 0");
  }
}

void read_likelihood(Config config, LikelihoodOptions& likelihood) {
  config.optional("model_sigma", Dimension::length, likelihood.model_sigma_m);
  config.optional("drop_out", likelihood.drop_out);
  config.optional("outlier", likelihood.outlier);
  config.optional("background", likelihood.background);
  config.optional("background_depth", Dimension::length, likelihood.background_depth_m);
  config.finish();
  for (const auto& [key, share] :
       {std::pair{"drop_out", likelihood.drop_out}, std::pair{"outlier", likelihood.outlier},
        std::pair{"background", likelihood.background}}) {
    if (!(share > 0 && share < 0.9)) {
      throw config.error(key, "found a share outside (0, 90 %)");
    }
  }
  at_least(config, "background_depth", likelihood.background_depth_m, 0.1);
}

void read_noise(Config config, NoiseOptions& noise) {
  config.optional("min", noise.min);
  config.optional("max", noise.max);
  config.finish();
  if (!(noise.min > 0 && noise.min <= 1)) {
    throw config.error("min", "found a factor outside (0, 1]");
  }
  at_least(config, "max", noise.max, 1);
}

void read_hypotheses(Config config, HypothesisAcquisitionOptions& h) {
  config.optional("risk", h.risk);
  config.optional("bare_surface_sigma", Dimension::length, h.bare_surface_sigma_m);
  config.optional("min_returns", h.min_returns);
  config.optional("max_hypotheses", h.max_hypotheses);
  config.finish();
  if (!(h.risk > 0 && h.risk < 0.5)) {
    throw config.error("risk", "found a probability outside (0, 50 %)");
  }
  at_least(config, "bare_surface_sigma", h.bare_surface_sigma_m, 0);
  at_least(config, "min_returns", h.min_returns, 6);
  at_least(config, "max_hypotheses", h.max_hypotheses, 1);
}

void read_acquisition(Config config, EstimatorOptions& options) {
  options.acquisition_method = config.choice("method", acquisition_names());
  if (config.has("hypotheses")) read_hypotheses(config.section("hypotheses"), options.hypotheses);
  VoxelTemplateOptions& a = options.voxel_template;
  config.optional("beams", options.acquire_beams);
  config.optional("zoom_beams", options.zoom_beams);
  config.optional("min_elongation", a.min_elongation);
  config.optional("min_points", a.min_points);
  config.optional("point_sets", a.point_sets);
  config.optional("finalists_per_set", a.finalists_per_set);
  config.optional("decisive_margin", a.decisive_margin);
  config.optional("min_evidence", a.min_evidence);
  config.optional("min_explained", a.min_explained);
  config.optional("max_through", a.max_through);
  config.optional("min_inlier_share", a.min_inlier_share);
  config.optional("max_hypotheses", a.max_hypotheses);
  config.finish();
  at_least(config, "beams", options.acquire_beams, 10);
  at_least(config, "zoom_beams", options.zoom_beams, 10);
  at_least(config, "min_points", a.min_points, 12);
  at_least(config, "point_sets", a.point_sets, 1);
  at_least(config, "finalists_per_set", a.finalists_per_set, 1);
  at_least(config, "decisive_margin", a.decisive_margin, 0);
  at_least(config, "max_hypotheses", a.max_hypotheses, 1);
}

void read_icp(Config config, IcpOptions& icp) {
  if (config.has("registration")) {
    icp.registration =
        config.choice("registration", {"point_to_point", "point_to_plane"}) == "point_to_point"
            ? Registration::point_to_point
            : Registration::point_to_plane;
  }
  if (config.has("closest_points")) {
    icp.refine_closest_points = config.choice("closest_points", {"refined", "stored"}) == "refined";
  }
  config.optional("iterations", icp.max_iterations);
  config.optional("start_gate", Dimension::length, icp.start_gate_m);
  config.optional("min_gate", Dimension::length, icp.min_gate_m);
  config.optional("gate_sigmas", icp.gate_sigmas);
  config.optional("stop_translation", Dimension::length, icp.stop_translation_m);
  config.optional("stop_rotation", Dimension::angle, icp.stop_rotation_rad);
  config.finish();
  at_least(config, "iterations", icp.max_iterations, 1);
  at_least(config, "min_gate", icp.min_gate_m, 0.001);
  at_least(config, "start_gate", icp.start_gate_m, icp.min_gate_m);
}

void read_bounded_hough(Config config, BoundedHoughOptions& hough) {
  config.optional("voxel", hough.voxel);
  config.optional("levels", hough.levels);
  config.optional("reach", hough.reach);
  config.optional("kept", hough.kept);
  config.optional("max_points", hough.max_points);
  config.finish();
  at_least(config, "voxel", hough.voxel, 0.002);
  at_least(config, "levels", hough.levels, 1);
  at_least(config, "reach", hough.reach, 1);
  at_least(config, "kept", hough.kept, 1);
  at_least(config, "max_points", hough.max_points, 20);
}

void read_tracking(Config config, EstimatorOptions& options) {
  options.tracking_method = config.choice("method", tracking_names());
  IcpTrackingOptions& t = options.icp_tracking;
  if (config.has("icp")) read_icp(config.section("icp"), t.icp);
  if (config.has("bounded_hough")) {
    read_bounded_hough(config.section("bounded_hough"), options.bounded_hough);
  }
  const std::string strategy = config.choice("strategy", scan_strategy_names());
  parse_scan_strategy(strategy, options.strategy);
  config.optional("returns_per_scan", options.returns_per_scan);
  config.optional("max_scan_time", Dimension::time, options.max_scan_time_s);
  config.optional("beam_steps", t.beam_steps);
  config.optional("deskew", t.deskew);
  config.optional("min_used", t.min_used);
  config.optional("min_inlier_share", t.min_inlier_share);
  config.optional("max_residual", Dimension::length, t.max_residual_m);
  config.optional("max_shift", Dimension::length, t.max_shift_m);
  config.optional("max_turn", Dimension::angle, t.max_turn_rad);
  config.optional("min_explained", t.min_explained);
  config.optional("max_through", t.max_through);
  config.optional("covariance_scale", t.covariance_scale);
  config.optional("floor_translation", Dimension::length, t.floor_m);
  config.optional("floor_rotation", Dimension::angle, t.floor_rad);
  config.optional("lost_after", options.lost_after);
  config.optional("reacquire", options.reacquire);
  config.optional("streaming", options.streaming);
  config.optional("estimate_every", options.estimate_every);
  config.optional("request_latency", Dimension::time, options.request_latency_s);
  config.finish();
  if (options.streaming && options.tracking_method != "likelihood") {
    throw config.error("method", "found '" + options.tracking_method +
                                     "', expected 'likelihood': only that measures pose and "
                                     "velocity by a part of a scan when tracking is streaming");
  }
  at_least(config, "returns_per_scan", options.returns_per_scan, 10);
  at_least(config, "max_scan_time", options.max_scan_time_s, 0.01);
  at_least(config, "min_used", t.min_used, 6);
  at_least(config, "estimate_every", options.estimate_every, 1);
  at_least(config, "lost_after", options.lost_after, 1);
  at_least(config, "covariance_scale", t.covariance_scale, 0.1);
  at_least(config, "floor_translation", t.floor_m, 1e-6);
  at_least(config, "floor_rotation", t.floor_rad, 1e-6);
}

void read_alpha_beta(Config config, AlphaBetaOptions& tracker) {
  config.optional("alpha", tracker.alpha);
  config.optional("beta", tracker.beta);
  config.optional("linear_acceleration", Dimension::acceleration, tracker.linear_acceleration);
  config.optional("angular_acceleration", Dimension::angular_acceleration,
                  tracker.angular_acceleration);
  config.finish();
  if (!(tracker.alpha > 0 && tracker.alpha <= 1)) {
    throw config.error("alpha", "found a gain outside (0, 1]");
  }
  if (!(tracker.beta >= 0 && tracker.beta < 4 - 2 * tracker.alpha)) {
    throw config.error("beta",
                       "found a gain with which the filter is not stable, expected "
                       "0 <= beta < 4 - 2 alpha");
  }
}

void read_pose_filter(Config config, PoseFilterOptions& filter) {
  config.optional("linear_acceleration", Dimension::acceleration, filter.linear_acceleration);
  config.optional("angular_acceleration", Dimension::angular_acceleration,
                  filter.angular_acceleration);
  config.optional("unknown_speed", Dimension::speed, filter.unknown_speed);
  config.optional("unknown_rotation", Dimension::angular_speed, filter.unknown_rotation);
  config.optional("surprise_sigmas", filter.surprise_sigmas);
  config.finish();
  at_least(config, "surprise_sigmas", filter.surprise_sigmas, 1);
  at_least(config, "linear_acceleration", filter.linear_acceleration, 1e-9);
  at_least(config, "angular_acceleration", filter.angular_acceleration, 1e-9);
  at_least(config, "unknown_speed", filter.unknown_speed, 1e-6);
  at_least(config, "unknown_rotation", filter.unknown_rotation, 1e-6);
}

void read_tracker(Config config, EstimatorOptions& options) {
  options.tracker_method = config.choice("method", tracker_names());
  if (config.has("alpha_beta")) read_alpha_beta(config.section("alpha_beta"), options.alpha_beta);
  if (options.streaming && options.tracker_method != "se3") {
    throw config.error("method", "found '" + options.tracker_method +
                                     "', expected 'se3': only that can take in the few returns of "
                                     "each estimate when tracking is streaming");
  }
  if (config.has("se3")) read_pose_filter(config.section("se3"), options.pose_filter);
  config.optional("inertial_motion", options.inertial_motion);
  config.finish();
  if (options.inertial_motion && options.tracker_method != "se3") {
    throw config.error("inertial_motion", "found true, which only the method 'se3' can take in");
  }
}

void read_planner(Config config, PlannerOptions& planner) {
  config.optional("max_windows", planner.max_windows);
  config.optional("margin_sigmas", planner.margin_sigmas);
  config.optional("min_margin", Dimension::length, planner.min_margin_m);
  config.optional("min_share_in_view", planner.min_share_in_view);
  config.optional("surface_share", planner.surface_share);
  config.optional("dense_factor", planner.dense_factor);
  config.optional("equal_share", planner.equal_share);
  config.optional("spread_share", planner.spread_share);
  config.optional("view_cells", planner.view_cells);
  config.optional("min_cosine", planner.min_cosine);
  config.optional("design_tolerance", planner.design_tolerance);
  config.finish();
  at_least(config, "max_windows", planner.max_windows, 1);
  at_least(config, "dense_factor", planner.dense_factor, 1);
  at_least(config, "margin_sigmas", planner.margin_sigmas, 0.1);
  at_least(config, "view_cells", planner.view_cells, 100);
  at_least(config, "min_cosine", planner.min_cosine, 0);
  at_least(config, "design_tolerance", planner.design_tolerance, 1e-4);
  if (!(planner.equal_share >= 0 && planner.equal_share <= 1)) {
    throw config.error("equal_share", "must be from 0 to 100 %");
  }
  if (!(planner.spread_share >= 0 && planner.spread_share < 1)) {
    throw config.error("spread_share", "found a share outside [0, 100 %)");
  }
  if (!(planner.surface_share > 0 && planner.surface_share < 1)) {
    throw config.error("surface_share", "found a share outside (0, 100 %)");
  }
}

void read_ranges(Config config, RangeOptions& ranges) {
  config.optional("medium_beams", ranges.medium_beams);
  config.optional("hysteresis", ranges.hysteresis);
  config.optional("axis_returns", ranges.axis_returns);
  config.optional("search_growth", ranges.search_growth);
  config.optional("docking_region", ranges.docking_share);
  config.optional("docking_port", ranges.docking_port);
  config.finish();
  at_least(config, "medium_beams", ranges.medium_beams, 5);
  at_least(config, "axis_returns", ranges.axis_returns, 10);
  at_least(config, "search_growth", ranges.search_growth, 2);
  at_least(config, "docking_region", ranges.docking_share, 0.01);
  if (!(ranges.hysteresis >= 0 && ranges.hysteresis < 0.5)) {
    throw config.error("hysteresis", "found a share outside [0, 50 %)");
  }
}

void read_budgets(Config config, Budgets& budgets) {
  const auto read = [&](const std::string& key, std::int64_t& budget) {
    double time = static_cast<double>(budget) * 1e-6;
    config.optional(key, Dimension::time, time);
    expect_positive(config, key, time);
    budget = std::llround(1e6 * time);
  };
  read("track", budgets.track);
  read("acquire", budgets.acquire);
  read("model", budgets.model);
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
  if (config.has("likelihood")) {
    read_likelihood(config.section("likelihood"), options.voxel_template.likelihood);
  }
  if (config.has("noise")) read_noise(config.section("noise"), options.noise);
  options.icp_tracking.likelihood = options.voxel_template.likelihood;
  read_acquisition(config.section("acquisition"), options);
  read_tracking(config.section("tracking"), options);
  read_tracker(config.section("target_tracker"), options);
  read_planner(config.section("scan_planner"), options.planner);
  options.planner.bare_surface_sigma_m = options.hypotheses.bare_surface_sigma_m;
  options.likelihood_tracking.bare_surface_sigma_m = options.hypotheses.bare_surface_sigma_m;
  if (config.has("ranges")) read_ranges(config.section("ranges"), options.ranges);
  if (config.has("budgets")) read_budgets(config.section("budgets"), options.budgets);
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
