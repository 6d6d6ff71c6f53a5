// SPDX-License-Identifier: BSD-3-Clause
// Windows of the next scan.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "estimator/acquire/segmentation.h"
#include "estimator/node/estimator.h"

namespace berth::estimator {
namespace {

/// Consecutive zoomed scans before the whole field of view is scanned again.
constexpr int max_zoom_scans = 2;

/// The smallest window that contains both, with the first one's count and name.
Window hull(const Window& a, const Window& b) {
  const double left = std::min(a.azimuth - 0.5 * a.width, b.azimuth - 0.5 * b.width);
  const double right = std::max(a.azimuth + 0.5 * a.width, b.azimuth + 0.5 * b.width);
  const double low = std::min(a.elevation - 0.5 * a.height, b.elevation - 0.5 * b.height);
  const double high = std::max(a.elevation + 0.5 * a.height, b.elevation + 0.5 * b.height);
  return window_between(left, right, low, high, a.count, a.name);
}

}  // namespace

FieldOfView Estimator::field_of_view() const {
  return {setup_.lidar.field_of_view_width, setup_.lidar.field_of_view_height,
          setup_.lidar.minimum_step_rad, setup_.lidar.beam};
}

/// The sphere about the origin that contains the target in any attitude.
ModelSphere Estimator::whole_target(double margin) const {
  return {Vector3d::Zero(), model_->centre.norm() + model_->radius + margin};
}

std::vector<Window> Estimator::plan_windows() {
  const EstimatorOptions& o = setup_.options;
  if (now_.mode == Mode::ACQUIRING) {
    if (!zoom_.empty()) return zoom_;
    return {planner_->everything(search_beams_)};
  }
  if (now_.mode != Mode::TRACKING) return {};
  // A target near enough for its pose is scanned more densely until the pose is acquired.
  const bool looking = range_ == OperatingRange::long_range && near_enough_;
  const int beams = looking ? o.zoom_beams : now_.returns_per_scan;
  // The middle of the next scan.
  const double ahead = o.request_latency_s + 0.5 * beams / setup_.lidar.rate_hz;
  const std::int64_t then =
      std::max(last_input_utime_, tracker_->utime()) + static_cast<std::int64_t>(1e6 * ahead);
  const Pose pose = tracker_->predict(then);
  const Matrix6d covariance = tracker_->predicted_covariance(then);
  const double translation = largest_sigma(covariance.topLeftCorner<3, 3>());
  if (range_ == OperatingRange::long_range) {
    const auto window = window_around(whole_target(o.planner.margin_sigmas * translation), pose,
                                      field_of_view(), beams, "target");
    return window ? std::vector<Window>{*window} : std::vector<Window>{};
  }
  const double rotation = largest_sigma(covariance.bottomRightCorner<3, 3>());
  const double sigma = std::hypot(translation, rotation * model_->canonical.half_length);
  // Margins are limited: larger windows have no advantage over the whole field of view.
  const double max_sigma = 0.3 * model_->canonical.half_length;
  if (range_ == OperatingRange::short_range) {
    if (auto sphere = docking_region(*model_, o.ranges, pose)) {
      sphere->radius += o.planner.margin_sigmas * std::min(sigma, max_sigma);
      const auto window = window_around(*sphere, pose, field_of_view(), beams, "docking interface");
      if (window) return {*window};
    }
  }
  return planner_->plan(pose, std::min(sigma, max_sigma), now_.strategy, beams);
}

std::vector<Window> Estimator::zoom_windows(const Pose& pose, double margin) const {
  if (now_.acquire_returns == 0) {
    return planner_->around({pose}, margin, setup_.options.zoom_beams);
  }
  return planner_->outline(pose, margin, now_.acquire_returns);
}

/// The next scan consists of these windows, if any, and of the surroundings of the target at these
/// poses, with half the density of a search and wide enough to recognise planes wider than the
/// target: a strip of a wall or a floor may look like part of it.
void Estimator::set_zoom(std::vector<Window> windows, const std::vector<Pose>& poses) {
  if (windows.empty() || zoom_scans_ >= max_zoom_scans) return;
  zoom_ = std::move(windows);
  const FieldOfView field = field_of_view();
  std::optional<Window> about;
  for (const Pose& pose : poses) {
    const auto window = window_around({model_->centre, max_plane_radii * model_->radius}, pose,
                                      field, 1, "surroundings");
    if (window) about = about ? hull(*about, *window) : *window;
  }
  if (!about) return;
  const double share = about->width * about->height / (field.width * field.height);
  about->count = std::max(1, static_cast<int>(0.5 * share * setup_.options.acquire_beams));
  zoom_.push_back(*about);
}

/// More beams for the next search where the target may lie between beams: at the end of the range
/// gate, or, after returns without a target, where fewer beams than in a zoomed scan would meet it
/// at the largest distance of medium range.
void Estimator::densify_search(bool met_something) {
  const double area = setup_.lidar.field_of_view_width * setup_.lidar.field_of_view_height;
  double reach = std::min(now_.gate.far, setup_.lidar.beam.range_max_m);
  double apart = 0.5 * model_->radius;
  if (met_something) {
    reach = std::min(reach, ranges_->far());
    apart = model_->radius * std::sqrt(std::numbers::pi / setup_.options.zoom_beams);
  }
  if (reach * std::sqrt(area / search_beams_) < apart) return;
  search_beams_ =
      std::min(search_beams_ * setup_.options.ranges.search_growth, setup_.lidar.beams_max);
}

}  // namespace berth::estimator
