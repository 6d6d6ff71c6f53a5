// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/segmentation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/core/random.h"
#include "estimator/acquire/pose_odds.h"

namespace berth::estimator {
namespace {

/// Large planes.
constexpr int max_planes = 8;
constexpr int draws = 150;
constexpr std::size_t min_returns = 20;
constexpr std::size_t max_compared = 2000;  // returns that score a plane: computing time only
constexpr double min_filled = 0.15;         // of width^2

/// m^2, normal to the beam, per beam of its pixel.
double area_at(const RangeImage& image, int b) {
  const auto [from, to] = image.beams_at(image.pixel_of(b));
  const double side =
      image.beams()[static_cast<std::size_t>(b)].range * image.spacing() * image.pixels_apart(b);
  return side * side / static_cast<double>(to - from);
}

/// Whether the returns' bounding box is smaller than the width of a large plane.
bool fits_within(const RangeImage& image, double width) {
  constexpr double far = std::numeric_limits<double>::max();
  Box box{Vector3d::Constant(far), Vector3d::Constant(-far)};
  for (const Beam& beam : image.beams()) {
    if (!beam.hit()) continue;
    const Vector3d p = image.axes() * beam.point();
    box.low = box.low.cwiseMin(p);
    box.high = box.high.cwiseMax(p);
  }
  return box.size().norm() < width;
}

bool is_large(const RangeImage& image, const std::vector<int>& members, const FittedPlane& plane,
              double width) {
  const Vector3d normal = plane.axes.col(0);
  const Vector3d along = plane.axes.col(2);
  double low = 0, high = 0, area = 0;
  for (const int m : members) {
    const Beam& beam = image.beams()[static_cast<std::size_t>(m)];
    const double t = along.dot(beam.point() - plane.mean);
    low = std::min(low, t);
    high = std::max(high, t);
    area += area_at(image, m) / std::max(0.1, std::abs(normal.dot(beam.direction)));
  }
  const double extent = high - low;
  return extent > width && area > min_filled * extent * extent;
}

/// Planar segments.
constexpr double off_sigmas = 3;   // distance of a return from its plane
constexpr double min_slope = 0.1;  // cosine of incidence
constexpr int seed_steps = 2;      // to each side of a seed
constexpr std::size_t min_seed = 8;

}  // namespace

FittedPlane plane_through(const RangeImage& image, const std::vector<int>& beams) {
  FittedPlane plane{Vector3d::Zero(), Matrix3d::Zero()};
  for (const int b : beams) plane.mean += image.beams()[static_cast<std::size_t>(b)].point();
  plane.mean /= static_cast<double>(beams.size());
  Matrix3d scatter = Matrix3d::Zero();
  for (const int b : beams) {
    const Vector3d d = image.beams()[static_cast<std::size_t>(b)].point() - plane.mean;
    scatter += d * d.transpose();
  }
  plane.axes = Eigen::SelfAdjointEigenSolver<Matrix3d>(scatter).eigenvectors();
  return plane;
}

LargePlanes large_planes(const RangeImage& image, double width) {
  struct Return {
    int beam;
    Vector3d point;  // m
    double area;     // m^2, cumulative
  };
  LargePlanes found;
  found.of_beam.assign(image.beams().size(), -1);
  if (fits_within(image, width)) return found;
  std::vector<Return> rest;
  for (std::size_t b = 0; b < image.beams().size(); ++b) {
    if (image.beams()[b].hit()) rest.push_back({static_cast<int>(b), image.beams()[b].point(), 0});
  }
  const double slack = 3 * image.noise().range_sigma_m + 0.005;
  Random random(1, "large planes");
  // Points are drawn and planes scored by area: dense scanning does not make a plane larger.
  for (int plane = 0; plane < max_planes && rest.size() > min_returns; ++plane) {
    double area = 0;
    for (Return& r : rest) r.area = area += area_at(image, r.beam);
    const auto any = [&] {
      const double at = random.uniform() * area;
      return std::upper_bound(rest.begin(), rest.end() - 1, at,
                              [](double value, const Return& r) { return value < r.area; })
          ->point;
    };
    const std::size_t every = 1 + rest.size() / max_compared;
    double best = 0;
    Vector3d best_place = Vector3d::Zero();
    Vector3d best_normal = Vector3d::Zero();
    for (int d = 0; d < draws; ++d) {
      const Vector3d a = any(), b = any(), c = any();
      if ((b - a).norm() > width || (c - a).norm() > width) continue;
      const Vector3d square = (b - a).cross(c - a);
      if (square.norm() < 0.05 * width * width) continue;
      const Vector3d normal = square.normalized();
      double on = 0, before = 0;
      for (std::size_t i = every - 1; i < rest.size(); i += every) {
        if (std::abs(normal.dot(rest[i].point - a)) < slack) on += rest[i].area - before;
        before = rest[i].area;
      }
      if (on <= best) continue;
      best = on;
      best_place = a;
      best_normal = normal;
    }
    if (best == 0) break;
    std::vector<char> marked(found.of_beam.size(), 0);
    std::erase_if(rest, [&](const Return& r) {
      const bool on = std::abs(best_normal.dot(r.point - best_place)) < slack;
      if (on) marked[static_cast<std::size_t>(r.beam)] = 1;
      return on;
    });
    for (const std::vector<int>& members :
         regions(image, marked, 2, [](int, int) { return true; })) {
      if (members.size() < min_returns) continue;
      const FittedPlane through = plane_through(image, members);
      if (!is_large(image, members, through, width)) continue;
      for (const int m : members) {
        found.of_beam[static_cast<std::size_t>(m)] = static_cast<int>(found.planes.size());
      }
      found.planes.push_back(through);
    }
  }
  return found;
}

std::vector<double> log_background(const RangeImage& image, const LargePlanes& planes) {
  constexpr double prior_beams = 20;
  constexpr int steps = 8;
  std::vector<double> result = image.log_background();
  struct Predicted {
    std::size_t beam;
    double by_plane, by_neighbours;  // 1/m
  };
  std::vector<Predicted> predicted;
  for (std::size_t b = 0; b < result.size(); ++b) {
    const Beam& beam = image.beams()[b];
    if (!beam.hit()) continue;
    double density = 0;
    for (const FittedPlane& plane : planes.planes) {
      const double slope = plane.axes.col(0).dot(beam.direction);
      const double off = beam.range - plane.axes.col(0).dot(plane.mean) / slope;
      const double variance = range_variance(image.noise(), 0, beam.range, std::abs(slope));
      density = std::max(density, std::exp(-0.5 * off * off / variance) /
                                      std::sqrt(2 * std::numbers::pi * variance));
    }
    if (density * image.depth() < 1) continue;
    predicted.push_back({b, density, std::exp(result[b])});
  }
  double share = 0.5;
  const auto mixed = [&share](const Predicted& f) {
    return share * f.by_plane + (1 - share) * f.by_neighbours;
  };
  for (int step = 0; step < steps; ++step) {
    double right = 0.5 * prior_beams;
    for (const Predicted& f : predicted) right += share * f.by_plane / mixed(f);
    share = right / (static_cast<double>(predicted.size()) + prior_beams);
  }
  for (const Predicted& f : predicted) result[f.beam] = std::log(mixed(f));
  return result;
}

PlaneSegments plane_segments(const RangeImage& image, const std::vector<char>& candidates) {
  const auto& beams = image.beams();
  PlaneSegments result;
  result.of_beam.assign(beams.size(), -1);
  const auto unassigned = [&](int b) {
    const auto at = static_cast<std::size_t>(b);
    return candidates[at] != 0 && beams[at].hit() && result.of_beam[at] < 0;
  };
  const auto on = [&](int b, const FittedPlane& plane) {
    const Beam& beam = beams[static_cast<std::size_t>(b)];
    const Vector3d normal = plane.axes.col(0);
    const double slope = normal.dot(beam.direction);
    if (std::abs(slope) < min_slope) return false;
    const double variance = range_variance(image.noise(), 0, beam.range, std::abs(slope));
    const double off = beam.range - normal.dot(plane.mean) / slope;
    return std::abs(off) < off_sigmas * std::sqrt(variance);
  };
  for (int start = 0; start < static_cast<int>(beams.size()); ++start) {
    if (!unassigned(start)) continue;
    std::vector<int> members;
    for_each_about(image, start, seed_steps, [&](int b) {
      if (unassigned(b)) members.push_back(b);
    });
    if (members.size() < min_seed) continue;
    FittedPlane plane = plane_through(image, members);
    if (!std::all_of(members.begin(), members.end(), [&](int b) { return on(b, plane); })) continue;
    // A plane through few beams is tilted by their noise: refitted to the returns it gains.
    for (std::size_t before = 0;; before = members.size()) {
      std::vector<char> marked(beams.size());
      for (std::size_t b = 0; b < marked.size(); ++b)
        marked[b] = unassigned(static_cast<int>(b)) ? 1 : 0;
      members = connected(image, marked, start, 1, [&](int, int b) { return on(b, plane); });
      if (members.size() < min_seed || 10 * members.size() < 11 * before) break;
      plane = plane_through(image, members);
    }
    if (members.size() < 3 * min_seed) continue;
    for (const int b : members) {
      result.of_beam[static_cast<std::size_t>(b)] = static_cast<int>(result.code_length.size());
    }
    const double known =
        image.noise().range_sigma_m * std::sqrt(3 / static_cast<double>(members.size()));
    result.code_length.push_back(
        std::max(0.0, 3 * std::log(image.depth() / known) - 1.5 * std::log(2 * std::numbers::pi)));
  }
  return result;
}

}  // namespace berth::estimator
