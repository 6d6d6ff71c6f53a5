// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/align_points.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/pose.h"
#include "estimator/model/closest_point_grid.h"
#include "estimator/model/lanes.h"

namespace berth::estimator {
namespace {

/// Sums of Gauss-Newton rows, w J J^T and w r J, four rows at a time in vector registers. The order
/// of summation is fixed: the same bits every time.
class NormalSums {
 public:
  NormalSums() {
    products_.fill(Lane::Zero());
    residuals_.fill(Lane::Zero());
  }

  /// Four rows J = [normal; torque] with weights w, weights times residuals wr.
  void add(const Four3& normal, const Four3& torque, const Four& w, const Four& wr) {
    const Lane weight = lane(w);
    const Lane residual = lane(wr);
    const std::array<Lane, 6> j = {lane(normal.x), lane(normal.y), lane(normal.z),
                                   lane(torque.x), lane(torque.y), lane(torque.z)};
    std::size_t k = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const Lane weighted = weight * j[i];
      for (std::size_t n = i; n < 6; ++n) products_[k++] += weighted * j[n];
    }
    for (std::size_t i = 0; i < 6; ++i) residuals_[i] += residual * j[i];
  }

  /// Sum of w J J^T.
  Matrix6d products() const {
    Matrix6d a;
    std::size_t k = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = i; j < 6; ++j) a(i, j) = a(j, i) = products_[k++].sum();
    }
    return a;
  }
  /// Sum of w r J.
  Vector6d residuals() const {
    Vector6d b;
    for (std::size_t i = 0; i < 6; ++i) b[static_cast<Eigen::Index>(i)] = residuals_[i].sum();
    return b;
  }

 private:
  using Lane = Eigen::Array4d;

  static Lane lane(const Four& value) { return {value[0], value[1], value[2], value[3]}; }

  std::array<Lane, 21> products_;
  std::array<Lane, 6> residuals_;
};

/// The points that a pose places inside the grid, in groups of four; the last group is padded. m.
class TurnedPoints {
 public:
  static constexpr std::size_t lanes = 4;

  explicit TurnedPoints(std::size_t max_points) : voxels_(max_points + lanes) {
    for (std::vector<double>& axis : axes_) axis.resize(max_points + lanes);
  }

  /// @return their number.
  std::size_t turn(const ClosestPointGrid& grid, std::span<const Vector3d> points,
                   const Pose& pose) {
    const Matrix3d rotation = pose.rotation.toRotationMatrix();
    const Vector3d& shift = pose.position;
    shift_ = {four(shift.x()), four(shift.y()), four(shift.z())};
    std::size_t count = 0;
    for (const Vector3d& point : points) {
      const Vector3d arm = rotation * point;
      const std::int64_t voxel = grid.voxel(arm + shift);
      if (voxel < 0) continue;
      put_at(count, arm, voxel);
      ++count;
    }
    for (std::size_t i = count; i < count + lanes; ++i) put_at(i, Vector3d::Zero(), 0);
    return count;
  }
  /// Rotated as by the pose, without translation.
  Four3 arms(std::size_t from) const {
    return {four_at(&axes_[0][from]), four_at(&axes_[1][from]), four_at(&axes_[2][from])};
  }
  /// Transformed by the pose.
  Four3 places(std::size_t from) const { return arms(from) + shift_; }
  const std::int64_t* voxels_at(std::size_t from) const { return &voxels_[from]; }

 private:
  void put_at(std::size_t i, const Vector3d& arm, std::int64_t voxel) {
    for (std::size_t k = 0; k < 3; ++k) axes_[k][i] = arm[static_cast<Eigen::Index>(k)];
    voxels_[i] = voxel;
  }

  Four3 shift_{};
  std::array<std::vector<double>, 3> axes_;
  std::vector<std::int64_t> voxels_;
};

}  // namespace

std::vector<Vector3d> sampled_evenly(std::span<const Vector3d> points, std::size_t max) {
  const std::size_t count = std::min(max, points.size());
  std::vector<Vector3d> sample;
  sample.reserve(count);
  for (std::size_t i = 0; i < count; ++i) sample.push_back(points[i * points.size() / count]);
  return sample;
}

Pose align_points(const ClosestPointGrid& grid, std::span<const Vector3d> points,
                  const Pose& to_model, double first_gate, double last_gate, int iterations) {
  Pose pose = to_model;
  TurnedPoints turned(points.size());
  for (int i = 0; i < iterations; ++i) {
    const double share = iterations > 1 ? static_cast<double>(i) / (iterations - 1) : 1;
    const double gate = first_gate * std::pow(last_gate / first_gate, share);
    const std::size_t used = turned.turn(grid, points, pose);
    if (used < 6) return pose;
    NormalSums sums;
    double inertia = 0;
    for (std::size_t from = 0; from < used; from += TurnedPoints::lanes) {
      const Four3 arm = turned.arms(from);
      const Four3 place = turned.places(from);
      const ClosestPointGrid::FourMatches match = grid.refined(place, turned.voxels_at(from));
      const Four3 off = match.point - place;
      const Four distance = root(off.dot(off));
      // Beyond the edge of a panel the direction to the closest point is not its normal.
      const Four3 along = chosen(distance > 1e-6, off / distance, match.normal);
      const Four ratio = distance / gate;
      const Four spread = 1 + ratio * ratio;
      Four weight = 1 / (spread * spread);
      for (std::size_t n = 0; n < TurnedPoints::lanes; ++n) {
        if (from + n >= used) weight[n] = 0;
      }
      sums.add(along, arm.cross(along), weight, weight * distance);
      const Four pull = weight * arm.dot(arm);
      for (std::size_t n = 0; n < TurnedPoints::lanes; ++n) inertia += pull[n];
    }
    Matrix6d a = sums.products();
    // Regularisation of unobservable directions.
    const double trace = a.diagonal().head<3>().sum();
    a.diagonal().head<3>().array() += 1e-3 * trace + 1e-12;
    a.diagonal().tail<3>().array() += 1e-3 * inertia + 1e-12;
    pose = perturbed(pose, a.ldlt().solve(sums.residuals()));
  }
  return pose;
}

}  // namespace berth::estimator
