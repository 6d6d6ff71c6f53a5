// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/plan/scan_planner.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "estimator/plan/information_planner.h"

namespace berth::estimator {

namespace {

const char* name_of(ScanRegion::Kind kind) {
  switch (kind) {
    case ScanRegion::Kind::corner:
      return "corner";
    case ScanRegion::Kind::edge:
      return "edge";
    case ScanRegion::Kind::surface:
      break;
  }
  return "surface";
}

/// Farthest point sampling of regions.
std::vector<const ScanRegion*> spread(const std::vector<const ScanRegion*>& regions,
                                      std::size_t count) {
  if (regions.size() <= count) return regions;
  std::vector<const ScanRegion*> chosen = {regions.front()};
  std::vector<float> distance(regions.size(), std::numeric_limits<float>::infinity());
  while (chosen.size() < count) {
    std::size_t farthest = 0;
    for (std::size_t i = 0; i < regions.size(); ++i) {
      distance[i] =
          std::min(distance[i], (regions[i]->position - chosen.back()->position).squaredNorm());
      if (distance[i] > distance[farthest]) farthest = i;
    }
    chosen.push_back(regions[farthest]);
  }
  return chosen;
}

}  // namespace

const std::vector<std::string>& scan_strategy_names() {
  static const std::vector<std::string> names = {
      "dense", "sparse", "corners", "edges", "corners+sparse", "edges+sparse", "information"};
  return names;
}

bool parse_scan_strategy(const std::string& name, ScanStrategy& strategy) {
  const auto& names = scan_strategy_names();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return false;
  strategy = static_cast<ScanStrategy>(found - names.begin());
  return true;
}

std::vector<const ScanRegion*> ScanPlanner::visible(const Pose& pose, ScanRegion::Kind kind) const {
  const Vector3d eye = pose.inverse().position;
  std::vector<const ScanRegion*> result;
  for (const ScanRegion& region : model_.regions) {
    if (region.kind != kind) continue;
    const Vector3d place = region.position.cast<double>();
    const Vector3d to_eye = eye - place;
    if (!region.visible_from.contains(nearest_direction(to_eye))) continue;
    // The centre may be on the hidden side of an edge: any hit within the region counts.
    RayHit hit;
    const double range = to_eye.norm();
    const double reach = static_cast<double>(region.radius);
    if (!model_.caster.cast({eye, -to_eye / range}, range + reach, hit)) continue;
    if (hit.range < range - reach) continue;
    result.push_back(&region);
  }
  return result;
}

double ScanPlanner::clip(Window& window) const {
  const double area = window.width * window.height;
  const double left = std::max(window.azimuth - 0.5 * window.width, -0.5 * field_.width);
  const double right = std::min(window.azimuth + 0.5 * window.width, 0.5 * field_.width);
  const double low = std::max(window.elevation - 0.5 * window.height, -0.5 * field_.height);
  const double high = std::min(window.elevation + 0.5 * window.height, 0.5 * field_.height);
  if (right <= left || high <= low) return 0;
  window.azimuth = 0.5 * (left + right);
  window.elevation = 0.5 * (low + high);
  window.width = right - left;
  window.height = high - low;
  return window.width * window.height / area;
}

void ScanPlanner::add(const Pose& pose, double margin, ScanRegion::Kind kind, int beams,
                      std::vector<Window>& windows) const {
  std::vector<const ScanRegion*> in_view;
  const auto window_of = [&](const ScanRegion& region, Window& window) {
    const Vector3d place = pose * region.position.cast<double>();
    const double range = place.norm();
    if (place.z() <= 0 || range < field_.beam.range_min_m) return false;
    beam_angles(place, window.azimuth, window.elevation);
    const double half =
        std::asin(std::min(0.5, (static_cast<double>(region.radius) + margin) / range));
    window.height = 2 * half;
    window.width = 2 * half / std::cos(window.elevation);
    window.name = name_of(kind);
    return clip(window) >= options_.min_share_in_view;
  };
  Window window;
  for (const ScanRegion* region : visible(pose, kind)) {
    if (window_of(*region, window)) in_view.push_back(region);
  }
  const auto most = static_cast<std::size_t>(std::clamp(beams / 10, 1, options_.max_windows));
  in_view = spread(in_view, most);
  const auto count = static_cast<int>(in_view.size());
  for (int i = 0; i < count; ++i) {
    window_of(*in_view[static_cast<std::size_t>(i)], window);
    window.count = beams * (i + 1) / count - beams * i / count;
    if (window.count > 0) windows.push_back(window);
  }
}

std::vector<Window> ScanPlanner::plan(const Pose& pose, double sigma, ScanStrategy strategy,
                                      int returns) const {
  std::vector<Window> windows = windows_of(pose, sigma, strategy, returns);
  if (strategy != ScanStrategy::information) compensate_misses(pose, windows);
  for (Window& window : windows) enforce_minimum_step(window);
  return windows;
}

void ScanPlanner::redistribute(const Pose& pose, double sigma, const std::vector<Window>& others,
                               std::vector<Window>& windows) const {
  int all = 0;
  for (const Window& window : windows) all += window.count;
  const auto free = static_cast<int>(std::lround((1 - options_.equal_share) * all));
  if (free <= 0 || windows.size() < 2) return;
  const std::vector<int> counts = InformationPlanner(model_, scene_, field_, options_)
                                      .share(pose, sigma, windows, free, others);
  const int given = std::accumulate(counts.begin(), counts.end(), 0);
  if (given == 0) return;  // none of them would return
  for (std::size_t i = 0; i < windows.size(); ++i) {
    const int equal = (all - given) * static_cast<int>(i + 1) / static_cast<int>(windows.size()) -
                      (all - given) * static_cast<int>(i) / static_cast<int>(windows.size());
    windows[i].count = equal + counts[i];
  }
  windows.erase(std::remove_if(windows.begin(), windows.end(),
                               [](const Window& window) { return window.count == 0; }),
                windows.end());
}

void ScanPlanner::compensate_misses(const Pose& pose, std::vector<Window>& windows) const {
  constexpr double most = 10;  // limits the effect of a wrong prediction or model
  int beams = 0;
  for (const Window& window : windows) beams += window.count;
  int returns = 0;
  scan_information(PoseView(model_, nullptr, field_.beam, options_, pose), windows, &returns);
  if (returns == 0) return;
  const double factor = std::min(most, static_cast<double>(beams) / returns);
  for (Window& window : windows) window.count = static_cast<int>(std::ceil(factor * window.count));
}

void ScanPlanner::enforce_minimum_step(Window& window) const {
  const double step = 1.001 * field_.minimum_step;
  const double area = window.count * step * step;
  if (area <= window.width * window.height) return;
  const double factor = std::sqrt(area / (window.width * window.height));
  window.width = std::min(factor * window.width, field_.width);
  window.height = std::min(area / window.width, field_.height);
  const double across = 0.5 * (field_.width - window.width);
  const double up = 0.5 * (field_.height - window.height);
  window.azimuth = std::clamp(window.azimuth, -across, across);
  window.elevation = std::clamp(window.elevation, -up, up);
}

std::vector<Window> ScanPlanner::windows_of(const Pose& pose, double sigma, ScanStrategy strategy,
                                            int beams) const {
  const double margin = options_.min_margin_m + options_.margin_sigmas * sigma;
  if (strategy == ScanStrategy::dense) {
    return around({pose}, margin, static_cast<int>(beams * options_.dense_factor));
  }
  if (strategy == ScanStrategy::information) {
    const std::vector<Window> outline = around({pose}, margin, beams);
    if (outline.empty()) return {};
    std::vector<Window> windows;
    const int sparse = static_cast<int>(std::lround(beams * options_.spread_share));
    if (sparse > 0) add(pose, margin, ScanRegion::Kind::surface, sparse, windows);
    const std::vector<Window> chosen =
        InformationPlanner(model_, scene_, field_, options_)
            .plan(pose, sigma, outline.front(), windows.empty() ? beams : beams - sparse, windows)
            .windows;
    windows.insert(windows.end(), chosen.begin(), chosen.end());
    return windows.empty() ? outline : windows;
  }
  std::vector<Window> windows;
  const bool combined =
      strategy == ScanStrategy::corners_sparse || strategy == ScanStrategy::edges_sparse;
  const int sparse_beams = combined ? static_cast<int>(std::lround(beams * options_.surface_share))
                                    : (strategy == ScanStrategy::sparse ? beams : 0);
  if (strategy == ScanStrategy::corners || strategy == ScanStrategy::corners_sparse) {
    add(pose, margin, ScanRegion::Kind::corner, beams - sparse_beams, windows);
  }
  if (strategy == ScanStrategy::edges || strategy == ScanStrategy::edges_sparse) {
    add(pose, margin, ScanRegion::Kind::edge, beams - sparse_beams, windows);
  }
  std::vector<Window> sparse;
  if (sparse_beams > 0) add(pose, margin, ScanRegion::Kind::surface, sparse_beams, sparse);
  redistribute(pose, sigma, sparse, windows);
  windows.insert(windows.end(), sparse.begin(), sparse.end());
  // Without corners in view the surface is scanned.
  if (windows.empty()) add(pose, margin, ScanRegion::Kind::surface, beams, windows);
  if (windows.empty()) return around({pose}, margin, beams);
  return windows;
}

std::vector<Window> ScanPlanner::around(const std::vector<Pose>& poses, double margin_m,
                                        int beams) const {
  constexpr double none = std::numeric_limits<double>::infinity();
  double left = none;
  double right = -none;
  double low = none;
  double high = -none;
  for (const Pose& pose : poses) {
    for (std::size_t i = 0; i < model_.surface.samples.size(); i += 8) {
      const Vector3d p = pose * model_.surface.samples[i].position.cast<double>();
      if (p.z() <= 0) continue;
      double azimuth = 0;
      double elevation = 0;
      beam_angles(p, azimuth, elevation);
      const double margin = margin_m / p.norm();
      left = std::min(left, azimuth - margin);
      right = std::max(right, azimuth + margin);
      low = std::min(low, elevation - margin);
      high = std::max(high, elevation + margin);
    }
  }
  if (!(left < right)) return {};
  Window window = window_between(left, right, low, high, beams, "target");
  // A part of the target in view is accepted.
  if (clip(window) <= 0) return {};
  return {window};
}

std::vector<Window> ScanPlanner::outline(const Pose& pose, double margin_m, int returns) const {
  std::vector<Window> windows = around({pose}, margin_m, returns);
  compensate_misses(pose, windows);
  for (Window& window : windows) enforce_minimum_step(window);
  return windows;
}

Window ScanPlanner::everything(int beams) const {
  return {0, 0, field_.width, field_.height, Pattern::raster, beams, 0, "field of view"};
}

}  // namespace berth::estimator
