// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <optional>
#include <vector>

#include "common/core/pose.h"
#include "estimator/model/closest_point_grid.h"

/// Where a mesh lies, by the returns on it.
struct MeshFit {
  berth::Pose pose;            ///< T_sensor_model
  berth::Matrix6d covariance;  ///< as berth::perturbed: [m; rad], sensor frame
  int used = 0;                ///< returns
};

/// Point-to-plane ICP [Chen, Medioni, Image and Vision Computing 10 (1992) 145]: Gauss-Newton on
/// the sum of (n . (p - T m))^2 over the returns p, m and n the mesh's point and normal nearest to
/// each.
/// @param points m, sensor frame  @param pose T_sensor_model to start from, to some decimetres
/// @return nothing where too few returns are near the mesh
inline std::optional<MeshFit> fit_to_mesh(const std::vector<berth::Vector3d>& points,
                                          const berth::estimator::ClosestPointGrid& mesh,
                                          berth::Pose pose) {
  using namespace berth;
  MeshFit fit;
  for (const double reach : {0.3, 0.2, 0.1, 0.1, 0.05, 0.05, 0.05}) {  // m
    Matrix6d information = 1e-6 * Matrix6d::Identity();
    Vector6d gradient = Vector6d::Zero();
    fit.used = 0;
    for (const Vector3d& point : points) {
      estimator::ClosestPointGrid::Match match;
      const Vector3d query = pose.inverse() * point;
      if (!mesh.refined(query, match) || (query - match.point).norm() > reach) continue;
      const Vector3d normal = pose.rotation * match.normal;
      Vector6d slope;
      slope << normal, (pose.rotation * match.point).cross(normal);
      information += slope * slope.transpose();
      gradient += slope * normal.dot(point - pose * match.point);
      ++fit.used;
    }
    if (fit.used < 100) return std::nullopt;
    pose = perturbed(pose, information.ldlt().solve(gradient));
    // Of 1 cm a return, and of the mesh, which errs by millimetres however many returns there are.
    fit.covariance = 1e-4 * information.inverse() + 9e-6 * Matrix6d::Identity();
  }
  fit.pose = pose;
  return fit;
}
