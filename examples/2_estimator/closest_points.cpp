// SPDX-License-Identifier: BSD-3-Clause
// An estimator of one's own (docs/own_estimator.md): Berth's acquisition, then point-to-plane ICP.
//
//   ./berth run --twin --estimator build/release/examples/closest_points.so PROCEDURE
//   ./berth run --estimator build/release/examples/closest_points PROCEDURE
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "estimator/node/scan_estimator.h"

using namespace berth;
using namespace berth::estimator;

namespace {

/// Point-to-plane ICP [Chen, Medioni, Image and Vision Computing 10 (1992) 145]: Gauss-Newton on
/// the sum of (n . (p - T m))^2 over the returns p, m and n the mesh's point and normal nearest to
/// each.
/// @param points m, sensor frame  @param pose T_sensor_model to start from, to some decimetres
/// @return nothing where too few returns are near the mesh
std::optional<ScanPose> fit_to_mesh(const std::vector<Vector3d>& points,
                                    const ClosestPointGrid& mesh, Pose pose) {
  ScanPose fit;
  for (const double reach : {0.3, 0.2, 0.1, 0.1, 0.05, 0.05, 0.05}) {  // m
    Matrix6d information = 1e-6 * Matrix6d::Identity();
    Vector6d gradient = Vector6d::Zero();
    fit.returns = 0;
    for (const Vector3d& point : points) {
      ClosestPointGrid::Match match;
      const Vector3d query = pose.inverse() * point;
      if (!mesh.refined(query, match) || (query - match.point).norm() > reach) continue;
      const Vector3d normal = pose.rotation * match.normal;
      Vector6d slope;
      slope << normal, (pose.rotation * match.point).cross(normal);
      information += slope * slope.transpose();
      gradient += slope * normal.dot(point - pose * match.point);
      ++fit.returns;
    }
    if (fit.returns < 100) return std::nullopt;
    pose = perturbed(pose, information.ldlt().solve(gradient));
    // Of 1 cm a return, and of the mesh, which errs by millimetres however many returns there are.
    fit.covariance = 1e-4 * information.inverse() + 9e-6 * Matrix6d::Identity();
  }
  fit.pose = pose;
  return fit;
}

class ClosestPoints final : public ScanEstimator {
 public:
  using ScanEstimator::ScanEstimator;

 private:
  std::string method() const override { return "closest_points"; }

  std::optional<ScanPose> estimate(const PreprocessedScan& scan,
                                   const std::optional<Pose>& last) override {
    const std::optional<Pose> start = last ? last : acquire(scan);
    if (!start) return std::nullopt;
    return fit_to_mesh(scan.points, model().grid, *start);
  }
};

}  // namespace

BERTH_ESTIMATOR_PLUGIN(make_estimator<ClosestPoints>)
