// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/view_atlas.h"

#include <algorithm>
#include <cmath>

#include "estimator/model/directions.h"

namespace berth::estimator {

namespace {

/// @return false when nothing is seen: the target is thinner than the raster from there.
bool visible_centroid(const RayCaster& caster, const Vector3d& centre, double radius,
                      const Vector3d& direction, double nearness, Vector3d& centroid) {
  constexpr int raster = 56;  // rays along the sphere's diameter
  const Matrix3d to_model = towards_viewer(direction).conjugate().toRotationMatrix();
  const double distance = radius / nearness;
  const Vector3d viewer = centre + distance * direction;
  const double reach = std::tan(std::asin(nearness));  // of the sphere, at distance 1
  Vector3d sum = Vector3d::Zero();
  int seen = 0;
  for (int row = 0; row < raster; ++row) {
    for (int column = 0; column < raster; ++column) {
      const double x = (column + 0.5) / raster * 2 - 1;
      const double y = (row + 0.5) / raster * 2 - 1;
      if (x * x + y * y > 1) continue;
      const Vector3d beam = to_model * Vector3d(x * reach, y * reach, 1).normalized();
      RayHit hit;
      if (!caster.cast({viewer, beam}, distance + radius, hit)) continue;
      sum += viewer + hit.range * beam;
      ++seen;
    }
  }
  if (seen > 0) centroid = sum / seen;
  return seen > 0;
}

}  // namespace

Vector3d View::centroid(double how_near) const {
  const double u = std::clamp(how_near, nearness.front(), nearness.back());
  std::size_t i = 1;
  while (i + 1 < nearness.size() && nearness[i] < u) ++i;
  const double share = (u - nearness[i - 1]) / (nearness[i] - nearness[i - 1]);
  return (1 - share) * centroids[i - 1] + share * centroids[i];
}

Quaterniond towards_viewer(const Vector3d& direction) {
  return Quaterniond::FromTwoVectors(direction, -Vector3d::UnitZ()).normalized();
}

std::vector<View> make_view_atlas(const RayCaster& caster, const Vector3d& centre, double radius,
                                  int count) {
  std::vector<View> atlas;
  for (const Vector3d& direction : spread_directions(count)) {
    View view;
    view.direction = direction;
    bool seen = true;
    for (std::size_t i = 0; i < View::nearness.size() && seen; ++i) {
      seen =
          visible_centroid(caster, centre, radius, direction, View::nearness[i], view.centroids[i]);
    }
    if (seen) atlas.push_back(view);
  }
  return atlas;
}

}  // namespace berth::estimator
