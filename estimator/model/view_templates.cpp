// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/view_templates.h"

#include <cmath>
#include <limits>

#include "estimator/model/visible_surface.h"

namespace berth::estimator {
namespace {

constexpr double viewer = 5;  // radii away
constexpr int pixels = 64;    // across the sphere

/// A rotation that maps `direction` (unit) to -z: from model axes to those of a viewer in that
/// direction, looking along +z.
Quaterniond towards_viewer(const Vector3d& direction) {
  return Quaterniond::FromTwoVectors(direction, -Vector3d::UnitZ()).normalized();
}

/// Farthest point sampling, from the point nearest to the mean.
Eigen::ArrayX3f farthest_point_sample(const std::vector<Vector3d>& all, int max) {
  const int count = std::min(max, static_cast<int>(all.size()));
  Eigen::ArrayX3f chosen(count, 3);
  if (all.empty()) return chosen;
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : all) mean += p;
  mean /= static_cast<double>(all.size());
  std::size_t next = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if ((all[i] - mean).squaredNorm() < (all[next] - mean).squaredNorm()) next = i;
  }
  std::vector<double> away(all.size(), std::numeric_limits<double>::infinity());
  for (int c = 0; c < count; ++c) {
    const Vector3d last = all[next];
    chosen.row(c) = last.transpose().cast<float>();
    for (std::size_t i = 0; i < all.size(); ++i) {
      away[i] = std::min(away[i], (all[i] - last).squaredNorm());
      if (away[i] > away[next]) next = i;
    }
  }
  return chosen;
}

}  // namespace

std::vector<ViewTemplate> make_view_templates(const RayCaster& caster, const Vector3d& centre,
                                              double radius, int count) {
  std::vector<ViewTemplate> templates;
  const double half = 1.02 * std::tan(std::asin(1 / viewer));
  const double pixel = 2 * half / pixels;
  for (const Vector3d& direction : spread_directions(count)) {
    ViewTemplate t;
    t.view = towards_viewer(direction);
    const Vector3d eye = centre + viewer * radius * direction;
    std::vector<Ray> rays;
    for (int y = 0; y < pixels; ++y) {
      for (int x = 0; x < pixels; ++x) {
        const Vector3d d((x + 0.5) * pixel - half, (y + 0.5) * pixel - half, 1);
        rays.push_back({eye, t.view.conjugate() * d.normalized()});
      }
    }
    std::vector<RayHit> hits(rays.size());
    caster.cast(rays, 2 * viewer * radius, hits);
    const auto at = [](int x, int y) { return static_cast<std::size_t>(x + pixels * y); };
    const auto met = [&hits](std::size_t i) { return std::isfinite(hits[i].range); };
    const auto place = [&](std::size_t i, double range) {
      return Vector3d(t.view * (eye + range * rays[i].direction - centre));
    };
    std::vector<Vector3d> inside, any, outside;
    double rim = 0;
    for (int y = 0; y < pixels; ++y) {
      for (int x = 0; x < pixels; ++x) {
        const std::size_t here = at(x, y);
        int neighbours = 0;
        std::size_t nearest_hit = here;
        int nearest_steps = 99;
        for (int v = std::max(0, y - 2); v <= std::min(pixels - 1, y + 2); ++v) {
          for (int u = std::max(0, x - 2); u <= std::min(pixels - 1, x + 2); ++u) {
            if (!met(at(u, v))) continue;
            const int away = std::max(std::abs(u - x), std::abs(v - y));
            if (away == 1 && met(here) &&
                std::abs(hits[at(u, v)].range - hits[here].range) < 0.1 * radius) {
              ++neighbours;
            }
            if (away < nearest_steps) {
              nearest_steps = away;
              nearest_hit = at(u, v);
            }
          }
        }
        if (met(here)) {
          any.push_back(place(here, hits[here].range));
          if (neighbours >= 6) inside.push_back(any.back());
          if (neighbours < 7) rim += 1;
          t.area += 1;
        } else if (nearest_steps == 2) {
          outside.push_back(place(here, hits[nearest_hit].range));
        }
      }
    }
    const double side = pixel * viewer * radius;
    t.area *= side * side;
    t.perimeter = rim * side;
    if (any.size() < ViewTemplate::surface_points) continue;
    t.points = farthest_point_sample(inside.size() < ViewTemplate::surface_points ? any : inside,
                                     ViewTemplate::surface_points);
    t.outside = farthest_point_sample(outside, ViewTemplate::outside_points);
    templates.push_back(t);
  }
  return templates;
}

}  // namespace berth::estimator
