// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include "common/core/ray_caster.h"
#include "estimator/scan/preprocessing.h"
#include "estimator/tracking/edge_nodes.h"

namespace berth::estimator {

/// A beam before the target, cast at where the target may be for all that other beams say.
struct EdgeView {
  const Beam* beam = nullptr;
  Matrix3d axes = Matrix3d::Identity();             // of the beam: right, up, along it; model frame
  Vector3d eye = Vector3d::Zero();                  // model frame
  Eigen::Matrix2d angle = Eigen::Matrix2d::Zero();  // covariance of its angle noise: right, up
  double range_variance = 0;                        // m^2

  // Of the target's displacement there, without this beam: [right; up; along], m.
  Vector3d mean = Vector3d::Zero();
  Matrix3d cavity = Matrix3d::Zero();

  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();  // of the beam across the target, rad^2
  Eigen::Matrix2d width = Eigen::Matrix2d::Zero();   // of a node, of that
  double range = 0;                                  // of the target there, m
  std::size_t nodes = 0;
  std::array<Eigen::Vector2d, edge_nodes_at_most> off;  // of nodes from the middle, rad
  std::array<Ray, edge_nodes_at_most> rays;
  std::array<RayHit, edge_nodes_at_most> hits;

  /// about: range of the target there, m; standard: as edge_nodes(). @return whether any node meets
  /// the target. Most beams pass it: half of the nodes tell.
  bool cast(const RayCaster& caster, double far, double about,
            std::span<const Eigen::Vector2d> standard);
  /// Whether all nodes meet the target.
  bool meets() const;
  /// Range of the nearest, m.
  double nearest() const;
  /// Whether all nodes meet one plane, to so many metres.
  bool one_plane(double tolerance) const;
};

}  // namespace berth::estimator
