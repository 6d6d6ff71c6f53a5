// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/visible_surface.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {
namespace {

struct Triangle {
  Vector3d a, b, c;

  Vector3d doubled_area() const { return (b - a).cross(c - a); }
  /// Point at (u, v) of the unit square, folded into the triangle: uniform stays uniform.
  Vector3d at(double u, double v) const {
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    return a + u * (b - a) + v * (c - a);
  }
};

double fraction(double x) { return x - std::floor(x); }

/// The directions from which a point of a triangle is visible, on either side.
DirectionSet visible_directions(const RayCaster& caster, const Vector3d& point,
                                const Vector3d& normal, double size) {
  constexpr double grazing = 0.05;  // cosine of incidence below which a beam hardly returns
  const double lift = 1e-5 * size;
  DirectionSet seen;
  const auto& directions = view_directions();
  for (int i = 0; i < direction_count; ++i) {
    const Vector3d& d = directions[static_cast<std::size_t>(i)];
    const double cosine = d.dot(normal);
    if (std::abs(cosine) < grazing) continue;
    const Vector3d start = point + normal * (cosine > 0 ? lift : -lift);
    if (!caster.occluded({start, d}, 3 * size)) seen.insert(i);
  }
  return seen;
}

}  // namespace

std::vector<Vector3d> spread_directions(int count) {
  const double golden_angle = radians(180.0) * (3.0 - std::sqrt(5.0));
  std::vector<Vector3d> result;
  result.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / count;
    const double radius = std::sqrt(1.0 - z * z);
    result.emplace_back(radius * std::cos(golden_angle * i), radius * std::sin(golden_angle * i),
                        z);
  }
  return result;
}

const std::array<Vector3d, direction_count>& view_directions() {
  static const std::array<Vector3d, direction_count> directions = [] {
    std::array<Vector3d, direction_count> result;
    const std::vector<Vector3d> spread = spread_directions(direction_count);
    std::copy(spread.begin(), spread.end(), result.begin());
    return result;
  }();
  return directions;
}

int nearest_direction(const Vector3d& direction) {
  const auto& directions = view_directions();
  int best = 0;
  double best_dot = -1e300;
  for (int i = 0; i < direction_count; ++i) {
    const double dot = directions[static_cast<std::size_t>(i)].dot(direction);
    if (dot > best_dot) {
      best_dot = dot;
      best = i;
    }
  }
  return best;
}

VisibleSurface find_visible_surface(const Mesh& mesh, const RayCaster& caster, int count) {
  // Visible from one direction only: through a crack.
  constexpr int min_directions = 2;
  // Steps of the R2 low-discrepancy sequence: even cover without random numbers.
  constexpr double step_u = 0.7548776662466927;
  constexpr double step_v = 0.5698402909980532;

  const double size = bounding_box(mesh).size().norm();
  double area = 0;
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    triangles.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
    area += 0.5 * triangles.back().doubled_area().norm();
  }
  const double per_area = count / area;

  VisibleSurface surface;
  double quota = 0;
  std::uint64_t index = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Vector3d doubled = triangles[t].doubled_area();
    const double norm = doubled.norm();
    if (!(norm > 0)) continue;
    const Vector3d normal = doubled / norm;
    quota += 0.5 * norm * per_area;
    bool seen = false;
    int tried = 0;
    for (; quota >= 0.5; ++tried) {
      quota -= 1;
      ++index;
      const double n = static_cast<double>(index);
      const Vector3d point = triangles[t].at(fraction(n * step_u), fraction(n * step_v));
      const DirectionSet from = visible_directions(caster, point, normal, size);
      if (from.size() < min_directions) continue;
      seen = true;
      int in_front = 0;
      for (int i = 0; i < direction_count; ++i) {
        if (!from.contains(i)) continue;
        in_front += view_directions()[static_cast<std::size_t>(i)].dot(normal) > 0 ? 1 : -1;
      }
      SurfaceSample sample;
      sample.position = point.cast<float>();
      sample.normal = (in_front >= 0 ? normal : Vector3d(-normal)).cast<float>();
      sample.triangle = static_cast<std::uint32_t>(t);
      sample.visible_from = from;
      surface.samples.push_back(sample);
    }
    // Triangles with no sample or a hidden one are probed at a few points.
    constexpr double probes[][2] = {{1 / 3.0, 1 / 3.0}, {0.1, 0.1}, {0.8, 0.1}, {0.1, 0.8}};
    for (const auto& probe : probes) {
      if (seen || tried > 8) break;
      seen = visible_directions(caster, triangles[t].at(probe[0], probe[1]), normal, size).size() >=
             min_directions;
    }
    if (seen) surface.triangles.push_back(static_cast<std::uint32_t>(t));
  }
  return surface;
}

}  // namespace berth::estimator
