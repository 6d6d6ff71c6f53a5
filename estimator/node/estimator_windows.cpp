// SPDX-License-Identifier: BSD-3-Clause
// Where the next scan looks.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "estimator/acquire/segmentation.h"
#include "estimator/node/estimator.h"

namespace berth::estimator {
namespace {

/// In a row, after which all of the field of view is scanned again: where the target is not, it is
/// not found, however often one looks.
constexpr int max_looks = 2;

/// The least window that holds both, with the first one's count and name.
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

/// About all of a target whose attitude is not known.
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
  // A target near enough for its pose is looked at more closely until that is found.
  const bool looking = range_ == OperatingRange::long_range && within_reach_;
  const int beams = looking ? o.zoom_beams : now_.returns_per_scan;
  // The middle of the scan to come.
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
  // Windows that have grown to the size of the target find nothing that the whole view does not.
  const double most = 0.3 * model_->canonical.half_length;
  if (range_ == OperatingRange::short_range) {
    if (auto sphere = docking_region(*model_, o.ranges, pose)) {
      sphere->radius += o.planner.margin_sigmas * std::min(sigma, most);
      const auto window = window_around(*sphere, pose, field_of_view(), beams, "docking interface");
      if (window) return {*window};
    }
  }
  return planner_->plan(pose, std::min(sigma, most), now_.strategy, beams);
}

std::vector<Window> Estimator::look_closer(const Pose& pose, double margin) const {
  if (now_.acquire_returns == 0) {
    return planner_->around({pose}, margin, setup_.options.zoom_beams);
  }
  return planner_->outline(pose, margin, now_.acquire_returns);
}

/// The next scan is these windows, if there are any, and what is about the target at these poses,
/// half as dense as a search, so far that a plane can be seen to be wider than the target: of a
/// floor or a wall that only a strip is seen of, nobody can tell that it is none of the target's.
void Estimator::look_at(std::vector<Window> windows, const std::vector<Pose>& poses) {
  if (windows.empty() || looks_ >= max_looks) return;
  zoom_ = std::move(windows);
  const FieldOfView field = field_of_view();
  std::optional<Window> about;
  for (const Pose& pose : poses) {
    const auto window =
        window_around({model_->centre, too_wide * model_->radius}, pose, field, 1, "surroundings");
    if (window) about = about ? hull(*about, *window) : *window;
  }
  if (!about) return;
  const double share = about->width * about->height / (field.width * field.height);
  about->count = std::max(1, static_cast<int>(0.5 * share * setup_.options.acquire_beams));
  zoom_.push_back(*about);
}

/// A target at the end of the range gate fits between beams that met nothing. Of beams that met
/// something, as many must meet the target as where it seems to be, as far away as its pose is
/// looked for.
void Estimator::search_more_finely(bool met_something) {
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
