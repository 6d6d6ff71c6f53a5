// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_view.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace berth::estimator {

namespace {

/// A node stands for a normal distribution about it, too: of the variance that the pose brings, so
/// many times its share among all. Without it a beam of which few nodes are left would know more
/// than it can.
constexpr double node_width = 4;

bool meets_target(const RayHit& hit) { return std::isfinite(hit.range); }

}  // namespace

bool EdgeView::cast(const RayCaster& caster, double far, double about,
                    std::span<const Eigen::Vector2d> standard) {
  range = about;
  nodes = standard.size();
  const Eigen::Matrix2d of_pose = cavity.topLeftCorner<2, 2>() / (range * range);
  spread = of_pose + angle;
  width = node_width / static_cast<double>(nodes) * of_pose;
  const Eigen::Matrix2d root = Eigen::Matrix2d(spread - width).llt().matrixL();
  const Eigen::Vector2d middle = -mean.head<2>() / range;
  for (std::size_t k = 0; k < nodes; ++k) {
    off[k] = root * standard[k];
    const Eigen::Vector2d at = middle + off[k];
    rays[k] = {eye, (axes * Vector3d(at.x(), at.y(), 1)).normalized()};
  }
  const std::size_t half = nodes / 2;
  const std::span all_rays(rays);
  const std::span all_hits(hits);
  caster.cast(all_rays.first(half), far, all_hits.first(half));
  if (std::none_of(hits.data(), hits.data() + half, meets_target)) return false;
  caster.cast(all_rays.subspan(half, half), far, all_hits.subspan(half, half));
  return true;
}

bool EdgeView::meets() const { return std::all_of(hits.data(), hits.data() + nodes, meets_target); }

double EdgeView::nearest() const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < nodes; ++k) least = std::min(least, hits[k].range);
  return least;
}

bool EdgeView::one_plane(double tolerance) const {
  if (!meets_target(hits[0])) return false;
  const Vector3d& normal = hits[0].normal;
  const Vector3d place = hits[0].range * rays[0].direction;
  for (std::size_t k = 1; k < nodes; ++k) {
    if (!meets_target(hits[k]) || normal.dot(hits[k].normal) < 0.99) return false;
    const double beside = normal.dot(hits[k].range * rays[k].direction - place);
    if (std::abs(beside) > tolerance) return false;
  }
  return true;
}

}  // namespace berth::estimator
