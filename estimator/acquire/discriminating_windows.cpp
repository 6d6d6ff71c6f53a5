// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/discriminating_windows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/acquire/pose_odds.h"

namespace berth::estimator {

namespace {

constexpr int raster = 64;      // beams along each side of what is looked at
constexpr int window_side = 8;  // of a window, in beams of the raster
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Rectangle {
  double low[2] = {infinity, infinity};  // azimuth, elevation
  double high[2] = {-infinity, -infinity};
};

/// Around the model in all poses, within the field of view.
Rectangle around_all(const TargetModel& model, const std::vector<Hypothesis>& hypotheses,
                     const FieldOfView& field) {
  Rectangle result;
  const double half[2] = {0.5 * field.width, 0.5 * field.height};
  for (const Hypothesis& h : hypotheses) {
    for (const SurfaceSample& s : model.surface.samples) {
      const Vector3d point = h.pose * s.position.cast<double>();
      if (point.z() <= 0) continue;
      double angles[2];
      beam_angles(point, angles[0], angles[1]);
      for (int i = 0; i < 2; ++i) {
        result.low[i] = std::min(result.low[i], std::max(angles[i], -half[i]));
        result.high[i] = std::max(result.high[i], std::min(angles[i], half[i]));
      }
    }
  }
  return result;
}

BeamMeets predicted(const TargetModel& model, const Pose& to_model, const Vector3d& beam,
                    const BeamModel& noise, double surface_sigma) {
  RayHit hit;
  const Ray ray{to_model.position, to_model.rotation * beam};
  const double far = (model.centre - to_model.position).norm() + model.radius;
  if (!model.caster.cast(ray, far, hit)) return {};
  const double cosine = std::abs(hit.normal.dot(ray.direction));
  return {hit.range, range_variance(noise, surface_sigma, hit.range, cosine)};
}

}  // namespace

std::vector<Window> discriminating_windows(const TargetModel& model,
                                           const std::vector<Hypothesis>& hypotheses,
                                           const FieldOfView& field, int beams,
                                           const BeamModel& noise, double surface_sigma) {
  constexpr std::size_t max_windows = 4;
  constexpr double min_share = 0.3;  // of what the best window tells
  if (hypotheses.size() < 2) return {};
  const Rectangle all = around_all(model, hypotheses, field);
  const double width = (all.high[0] - all.low[0]) / raster;
  const double height = (all.high[1] - all.low[1]) / raster;
  if (!(width > 0 && height > 0)) return {};

  std::vector<Pose> to_model;
  for (const Hypothesis& h : hypotheses) to_model.push_back(h.pose.inverse());
  // value[r][c]: what all beams above and to the left of (r, c) tell.
  std::vector<std::array<double, raster + 1>> value(raster + 1);
  std::vector<BeamMeets> met(hypotheses.size());
  for (int r = 0; r < raster; ++r) {
    for (int c = 0; c < raster; ++c) {
      const Vector3d beam =
          beam_direction(all.low[0] + (c + 0.5) * width, all.low[1] + (r + 0.5) * height);
      double told = 0;
      for (std::size_t i = 0; i < met.size(); ++i) {
        met[i] = predicted(model, to_model[i], beam, noise, surface_sigma);
        for (std::size_t j = 0; j < i; ++j) {
          told += hypotheses[i].probability * hypotheses[j].probability *
                  (expected_evidence(met[i], met[j], 2 * model.radius) +
                   expected_evidence(met[j], met[i], 2 * model.radius));
        }
      }
      const auto row = static_cast<std::size_t>(r);
      const auto column = static_cast<std::size_t>(c);
      value[row + 1][column + 1] =
          told + value[row][column + 1] + value[row + 1][column] - value[row][column];
    }
  }

  struct Place {
    double told;
    int row, column;
  };
  std::vector<Place> places;
  for (int r = 0; r + window_side <= raster; r += window_side / 2) {
    for (int c = 0; c + window_side <= raster; c += window_side / 2) {
      const auto row = static_cast<std::size_t>(r);
      const auto column = static_cast<std::size_t>(c);
      places.push_back({value[row + window_side][column + window_side] -
                            value[row][column + window_side] - value[row + window_side][column] +
                            value[row][column],
                        r, c});
    }
  }
  std::erase_if(places, [](const Place& p) { return p.told <= 0; });
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.told > b.told; });
  std::vector<Place> chosen;
  for (const Place& p : places) {
    if (chosen.size() == max_windows || p.told <= min_share * places.front().told) break;
    const bool overlaps = std::any_of(chosen.begin(), chosen.end(), [&](const Place& other) {
      return std::abs(p.row - other.row) < window_side &&
             std::abs(p.column - other.column) < window_side;
    });
    if (!overlaps) chosen.push_back(p);
  }
  std::vector<Window> windows;
  for (const Place& p : chosen) {
    windows.push_back({all.low[0] + (p.column + 0.5 * window_side) * width,
                       all.low[1] + (p.row + 0.5 * window_side) * height, window_side * width,
                       window_side * height, Pattern::raster,
                       beams / static_cast<int>(chosen.size()), 0, "discriminate"});
  }
  return windows;
}

}  // namespace berth::estimator
