// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/large_planes.h"

#include <cmath>

#include "common/core/random.h"
#include "estimator/acquire/image_regions.h"

namespace berth::estimator {
namespace {

constexpr int max_planes = 8;
constexpr int draws = 150;
constexpr double min_filled = 0.15;  // of width^2

bool is_large(const RangeImage& image, const std::vector<int>& members, double width) {
  const FittedPlane plane = plane_through(image, members);
  const Vector3d normal = plane.axes.col(0);
  const Vector3d along = plane.axes.col(2);
  double low = 0, high = 0, area = 0;
  for (const int m : members) {
    const Beam& beam = image.beams()[static_cast<std::size_t>(m)];
    const double t = along.dot(beam.point() - plane.mean);
    low = std::min(low, t);
    high = std::max(high, t);
    area += std::pow(beam.range * image.spacing(), 2) /
            std::max(0.1, std::abs(normal.dot(beam.direction)));
  }
  const double extent = high - low;
  return extent > width && area > min_filled * extent * extent;
}

}  // namespace

std::vector<char> on_large_planes(const RangeImage& image, double width, double sigma) {
  std::vector<char> on(image.beams().size(), 0);
  std::vector<int> rest;
  for (std::size_t b = 0; b < on.size(); ++b) {
    if (image.beams()[b].hit()) rest.push_back(static_cast<int>(b));
  }
  const double slack = 3 * sigma + 0.005;
  Random random(1, "large planes");
  const auto any = [&random](std::size_t count) {
    return static_cast<std::size_t>(random.uniform() * static_cast<double>(count));
  };
  for (int plane = 0; plane < max_planes && rest.size() > 30; ++plane) {
    std::size_t best = 0;
    Vector3d best_normal = Vector3d::Zero();
    int best_start = -1;
    for (int d = 0; d < draws; ++d) {
      const int start = rest[any(rest.size())];
      const Vector3d a = image.beams()[static_cast<std::size_t>(start)].point();
      const Vector3d b = image.beams()[static_cast<std::size_t>(rest[any(rest.size())])].point();
      const Vector3d c = image.beams()[static_cast<std::size_t>(rest[any(rest.size())])].point();
      if ((b - a).norm() > width || (c - a).norm() > width) continue;
      const Vector3d square = (b - a).cross(c - a);
      if (square.norm() < 0.05 * width * width) continue;
      const Vector3d normal = square.normalized();
      std::size_t count = 0;
      for (const int r : rest) {
        const Vector3d p = image.beams()[static_cast<std::size_t>(r)].point();
        if (std::abs(normal.dot(p - a)) < slack) ++count;
      }
      if (count <= best) continue;
      best = count;
      best_normal = normal;
      best_start = start;
    }
    if (best < 30) break;
    const Vector3d a = image.beams()[static_cast<std::size_t>(best_start)].point();
    std::vector<char> marked(on.size(), 0);
    std::vector<char> gone(on.size(), 0);
    for (const int r : rest) {
      const Vector3d p = image.beams()[static_cast<std::size_t>(r)].point();
      if (std::abs(best_normal.dot(p - a)) < slack) marked[static_cast<std::size_t>(r)] = 1;
    }
    bool any_large = false;
    for (const int r : rest) {
      if (marked[static_cast<std::size_t>(r)] == 0) continue;
      const std::vector<int> members =
          connected(image, marked, r, 2, [](int, int) { return true; });
      if (members.size() < 20 || !is_large(image, members, width)) continue;
      any_large = true;
      for (const int m : members) {
        on[static_cast<std::size_t>(m)] = 1;
        gone[static_cast<std::size_t>(m)] = 1;
      }
    }
    if (!any_large) break;
    std::erase_if(rest, [&gone](int r) { return gone[static_cast<std::size_t>(r)] != 0; });
  }
  return on;
}

}  // namespace berth::estimator
