// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/discriminating_windows.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace berth::estimator {

namespace {

constexpr int raster = 64;  // beams along each side of what is looked at
constexpr int side = 8;     // of a window, in beams of the raster
constexpr double nothing = std::numeric_limits<double>::infinity();

struct Rectangle {
  double low[2] = {nothing, nothing};  // azimuth, elevation
  double high[2] = {-nothing, -nothing};
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

double predicted_range(const TargetModel& model, const Pose& to_model, const Vector3d& beam) {
  RayHit hit;
  const double far = (model.centre - to_model.position).norm() + model.radius;
  return model.caster.cast({to_model.position, to_model.rotation * beam}, far, hit) ? hit.range
                                                                                    : nothing;
}

/// How much a beam tells, between 0 and 1: ranges that differ by more than a share of the length
/// tell no more than those that differ by that.
double tells(double a, double b, double length) {
  constexpr double enough = 0.02;
  if (a == b) return 0;
  if (a == nothing || b == nothing) return 1;
  return std::min(1.0, std::abs(a - b) / (enough * length));
}

}  // namespace

std::vector<Window> discriminating_windows(const TargetModel& model,
                                           const std::vector<Hypothesis>& hypotheses,
                                           const FieldOfView& field, int beams) {
  constexpr std::size_t most_windows = 4;
  constexpr double least_share = 0.3;  // of what the best window tells
  if (hypotheses.size() < 2) return {};
  const Rectangle all = around_all(model, hypotheses, field);
  const double width = (all.high[0] - all.low[0]) / raster;
  const double height = (all.high[1] - all.low[1]) / raster;
  if (!(width > 0 && height > 0)) return {};

  std::vector<Pose> to_model;
  for (const Hypothesis& h : hypotheses) to_model.push_back(h.pose.inverse());
  // value[r][c]: what all beams above and to the left of (r, c) tell.
  std::vector<std::array<double, raster + 1>> value(raster + 1);
  std::vector<double> ranges(hypotheses.size());
  for (int r = 0; r < raster; ++r) {
    for (int c = 0; c < raster; ++c) {
      const Vector3d beam =
          beam_direction(all.low[0] + (c + 0.5) * width, all.low[1] + (r + 0.5) * height);
      double told = 0;
      for (std::size_t i = 0; i < ranges.size(); ++i) {
        ranges[i] = predicted_range(model, to_model[i], beam);
        for (std::size_t j = 0; j < i; ++j) {
          told += hypotheses[i].probability * hypotheses[j].probability *
                  tells(ranges[i], ranges[j], model.target.length);
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
  for (int r = 0; r + side <= raster; r += side / 2) {
    for (int c = 0; c + side <= raster; c += side / 2) {
      const auto row = static_cast<std::size_t>(r);
      const auto column = static_cast<std::size_t>(c);
      places.push_back({value[row + side][column + side] - value[row][column + side] -
                            value[row + side][column] + value[row][column],
                        r, c});
    }
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.told > b.told; });
  std::vector<Place> chosen;
  for (const Place& p : places) {
    if (chosen.size() == most_windows || p.told <= least_share * places.front().told) break;
    const bool overlaps = std::any_of(chosen.begin(), chosen.end(), [&](const Place& other) {
      return std::abs(p.row - other.row) < side && std::abs(p.column - other.column) < side;
    });
    if (!overlaps) chosen.push_back(p);
  }
  std::vector<Window> windows;
  for (const Place& p : chosen) {
    windows.push_back({all.low[0] + (p.column + 0.5 * side) * width,
                       all.low[1] + (p.row + 0.5 * side) * height, side * width, side * height,
                       beams / static_cast<int>(chosen.size()), "discriminate"});
  }
  return windows;
}

}  // namespace berth::estimator
