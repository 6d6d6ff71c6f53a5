// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/discriminating_windows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "estimator/acquire/pose_odds.h"

namespace berth::estimator {

namespace {

constexpr int raster = 64;      // beams along each side of the region searched
constexpr int window_side = 8;  // side of a window, in beams of the raster
constexpr double infinity = std::numeric_limits<double>::infinity();

struct Rectangle {
  double low[2] = {infinity, infinity};  // azimuth, elevation
  double high[2] = {-infinity, -infinity};
};

/// Of the model in all poses, within the field of view.
Rectangle bounding_rectangle(const TargetModel& model, const std::vector<Hypothesis>& hypotheses,
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

ExpectedRange predicted(const TargetModel& model, const Pose& to_model, const Vector3d& beam,
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
  constexpr double min_share = 0.3;  // of the best window's evidence
  if (hypotheses.size() < 2) return {};
  const Rectangle all = bounding_rectangle(model, hypotheses, field);
  const double width = (all.high[0] - all.low[0]) / raster;
  const double height = (all.high[1] - all.low[1]) / raster;
  if (!(width > 0 && height > 0)) return {};

  std::vector<Pose> to_model;
  for (const Hypothesis& h : hypotheses) to_model.push_back(h.pose.inverse());
  // Integral image: value[r][c] is the evidence of all beams above and to the left of (r, c).
  std::vector<std::array<double, raster + 1>> value(raster + 1);
  std::vector<ExpectedRange> expected(hypotheses.size());
  for (int r = 0; r < raster; ++r) {
    for (int c = 0; c < raster; ++c) {
      const Vector3d beam =
          beam_direction(all.low[0] + (c + 0.5) * width, all.low[1] + (r + 0.5) * height);
      double evidence = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        expected[i] = predicted(model, to_model[i], beam, noise, surface_sigma);
        for (std::size_t j = 0; j < i; ++j) {
          evidence += hypotheses[i].probability * hypotheses[j].probability *
                      (expected_evidence(expected[i], expected[j], 2 * model.radius) +
                       expected_evidence(expected[j], expected[i], 2 * model.radius));
        }
      }
      const auto row = static_cast<std::size_t>(r);
      const auto column = static_cast<std::size_t>(c);
      value[row + 1][column + 1] =
          evidence + value[row][column + 1] + value[row + 1][column] - value[row][column];
    }
  }

  struct WindowCell {
    double evidence;
    int row, column;
  };
  std::vector<WindowCell> cells;
  for (int r = 0; r + window_side <= raster; r += window_side / 2) {
    for (int c = 0; c + window_side <= raster; c += window_side / 2) {
      const auto row = static_cast<std::size_t>(r);
      const auto column = static_cast<std::size_t>(c);
      cells.push_back({value[row + window_side][column + window_side] -
                           value[row][column + window_side] - value[row + window_side][column] +
                           value[row][column],
                       r, c});
    }
  }
  std::erase_if(cells, [](const WindowCell& p) { return p.evidence <= 0; });
  std::stable_sort(cells.begin(), cells.end(), [](const WindowCell& a, const WindowCell& b) {
    return a.evidence > b.evidence;
  });
  std::vector<WindowCell> chosen;
  for (const WindowCell& p : cells) {
    if (chosen.size() == max_windows || p.evidence <= min_share * cells.front().evidence) break;
    const bool overlaps = std::any_of(chosen.begin(), chosen.end(), [&](const WindowCell& other) {
      return std::abs(p.row - other.row) < window_side &&
             std::abs(p.column - other.column) < window_side;
    });
    if (!overlaps) chosen.push_back(p);
  }
  std::vector<Window> windows;
  for (const WindowCell& p : chosen) {
    windows.push_back({all.low[0] + (p.column + 0.5 * window_side) * width,
                       all.low[1] + (p.row + 0.5 * window_side) * height, window_side * width,
                       window_side * height, Pattern::raster,
                       beams / static_cast<int>(chosen.size()), 0, "discriminate"});
  }
  return windows;
}

}  // namespace berth::estimator
