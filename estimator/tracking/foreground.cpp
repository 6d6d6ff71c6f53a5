// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/foreground.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace berth::estimator {

namespace {

/// Of one end: normals as those of a Screen.
struct Planes {
  Vector3d across, from, to;
};

std::vector<Planes> planes_through(const Vector3d& eye, const std::vector<FaceBorders::End>& ends) {
  std::vector<Planes> planes;
  planes.reserve(ends.size());
  for (const FaceBorders::End& end : ends) {
    const Vector3d from = (end.from - eye).normalized();
    const Vector3d to = (end.to - eye).normalized();
    const Vector3d across = from.cross(to).normalized();
    planes.push_back({across, across.cross(from), to.cross(across)});
  }
  return planes;
}

/// What holds a triangle, as it is seen.
struct Cone {
  Vector3d axis;
  double sine;  // of the angle about it, or more

  Cone(const Vector3d& a, const Vector3d& b, const Vector3d& c) : axis((a + b + c).normalized()) {
    const double square =
        std::max({(a.normalized() - axis).squaredNorm(), (b.normalized() - axis).squaredNorm(),
                  (c.normalized() - axis).squaredNorm()});
    sine = std::sqrt(square);
  }

  bool crossed_by(const Planes& planes) const {
    return std::abs(planes.across.dot(axis)) < sine && planes.from.dot(axis) > -sine &&
           planes.to.dot(axis) > -sine;
  }
};

template <class Lanes>
void set(std::array<Lanes, 3>& vectors, std::size_t lane, const Vector3d& value) {
  for (std::size_t i = 0; i < 3; ++i)
    vectors[i][lane] = static_cast<float>(value[static_cast<Eigen::Index>(i)]);
}

}  // namespace

Foreground::Foreground(const TargetModel& model, const Vector3d& eye) : eye_(eye) {
  const Mesh& mesh = model.target.mesh;
  const std::vector<Planes> planes = planes_through(eye, model.borders.ends());
  std::vector<std::uint32_t> over;
  first_.reserve(mesh.triangles.size() + 1);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    first_.push_back(static_cast<std::uint32_t>(screens_.size()));
    const auto [front, back] = model.standing.before(t);
    const auto& corners = mesh.triangles[t];
    const Vector3d a = mesh.vertices[corners[0]] - eye;
    const Vector3d b = mesh.vertices[corners[1]] - eye;
    const Vector3d c = mesh.vertices[corners[2]] - eye;
    const auto& before = (b - a).cross(c - a).dot(a) < 0 ? front : back;
    if (before.empty()) continue;
    const Cone cone(a, b, c);
    over.clear();
    std::copy_if(before.begin(), before.end(), std::back_inserter(over),
                 [&](std::uint32_t end) { return cone.crossed_by(planes[end]); });
    for (std::size_t i = 0; i < over.size(); i += width) {
      Screen& screen = screens_.emplace_back();
      for (std::size_t n = 0; n < width; ++n) {
        const Planes& end = planes[over[std::min(i + n, over.size() - 1)]];
        set(screen.across, n, end.across);
        set(screen.from, n, end.from);
        set(screen.to, n, end.to);
      }
    }
  }
  first_.push_back(static_cast<std::uint32_t>(screens_.size()));
}

}  // namespace berth::estimator
