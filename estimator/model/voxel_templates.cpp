// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/voxel_templates.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace berth::estimator {

namespace {

constexpr int row_length = 64;

/// The word with every voxel shifted along x; voxels that leave the row are dropped.
std::uint64_t shifted(std::uint64_t row, int shift) {
  if (shift >= row_length || shift <= -row_length) return 0;
  return shift >= 0 ? row << shift : row >> -shift;
}

}  // namespace

CanonicalPose find_canonical_pose(const std::vector<SurfaceSample>& samples) {
  Vector3d centroid = Vector3d::Zero();
  for (const SurfaceSample& s : samples) centroid += s.position.cast<double>();
  const double count = std::max<double>(1, static_cast<double>(samples.size()));
  centroid /= count;
  Matrix3d scatter = Matrix3d::Zero();
  for (const SurfaceSample& s : samples) {
    const Vector3d d = s.position.cast<double>() - centroid;
    scatter += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter / count);
  // Signs of the axes agree with the model's axes: a canonical model is unchanged.
  const auto along_model = [](Vector3d axis) {
    Eigen::Index largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    return axis[largest] < 0 ? Vector3d(-axis) : axis;
  };
  const Vector3d major = along_model(eigen.eigenvectors().col(2));
  const Vector3d minor = along_model(eigen.eigenvectors().col(0));
  Matrix3d rows;
  rows << major.transpose(), minor.transpose(), major.cross(minor).transpose();

  CanonicalPose canonical;
  canonical.pose.rotation = Quaterniond(rows).normalized();
  canonical.pose.position = -(canonical.pose.rotation * centroid);
  canonical.spread = eigen.eigenvalues().reverse().cwiseMax(1e-12).cwiseSqrt();
  for (const SurfaceSample& s : samples) {
    const Vector3d p = canonical.pose * s.position.cast<double>();
    canonical.half_length = std::max(canonical.half_length, std::abs(p.x()));
    canonical.radius = std::max(canonical.radius, std::hypot(p.y(), p.z()));
  }
  return canonical;
}

void VoxelRows::occupy(const Vector3d& point, double cell) {
  const int x = static_cast<int>(std::floor(point.x() / cell)) + row_length / 2;
  const int y = static_cast<int>(std::floor(point.y() / cell)) + height / 2;
  const int z = static_cast<int>(std::floor(point.z() / cell)) + height / 2;
  if (x < 0 || y < 0 || z < 0 || x >= row_length || y >= height || z >= height) return;
  row(y, z) |= std::uint64_t{1} << x;
}

VoxelTemplates::VoxelTemplates(const std::vector<SurfaceSample>& samples,
                               const CanonicalPose& canonical, int rotations, int voxels_along_axis)
    : cell_(2 * canonical.half_length / voxels_along_axis) {
  height_ = 2 * (static_cast<int>(std::ceil(canonical.radius / cell_)) + 1);
  for (int r = 0; r < rotations; ++r) {
    VoxelRows& rows = templates_.emplace_back(height_);
    const double turn = 2 * radians(180.0) * r / rotations;
    const Pose placed = Pose{Vector3d::Zero(), rotation_from_vector({turn, 0, 0})} * canonical.pose;
    for (const SurfaceSample& s : samples) {
      rows.occupy(placed * s.position.cast<double>(), cell_);
    }
  }
}

double VoxelTemplates::angle(int rotation) const {
  return 2 * radians(180.0) * rotation / rotations();
}

std::vector<Correlation> VoxelTemplates::correlate(const std::vector<Vector3d>& points, int reach_x,
                                                   int reach_yz) const {
  struct Row {
    int y, z, count;
    std::uint64_t bits;
  };
  VoxelRows data(height_ + 2 * reach_yz);
  for (const Vector3d& p : points) data.occupy(p, cell_);
  std::vector<Row> occupied;
  for (int z = 0; z < data.height; ++z) {
    for (int y = 0; y < data.height; ++y) {
      const std::uint64_t bits = data.row(y, z);
      if (bits == 0) continue;
      occupied.push_back({y - reach_yz, z - reach_yz, __builtin_popcountll(bits), bits});
    }
  }
  // Shifts across the axis, small ones first: an early maximum prunes most others.
  std::vector<std::array<int, 2>> shifts;
  for (int dz = -reach_yz; dz <= reach_yz; ++dz) {
    for (int dy = -reach_yz; dy <= reach_yz; ++dy) shifts.push_back({dy, dz});
  }
  std::stable_sort(shifts.begin(), shifts.end(), [](const auto& a, const auto& b) {
    return a[0] * a[0] + a[1] * a[1] < b[0] * b[0] + b[1] * b[1];
  });

  // A smaller share of the data's voxels may fit at random.
  constexpr double min_share = 0.3;
  int total = 0;
  for (const Row& row : occupied) total += row.count;
  const int min_score = static_cast<int>(min_share * total);

  std::vector<Correlation> best(templates_.size());
  std::vector<std::pair<std::uint64_t, std::uint64_t>>
      pairs;  // rows of data and template that meet
  pairs.reserve(occupied.size());
  for (std::size_t r = 0; r < templates_.size(); ++r) {
    const VoxelRows& pattern = templates_[r];
    best[r].rotation = static_cast<int>(r);
    for (const auto& [dy, dz] : shifts) {
      pairs.clear();
      int at_most = 0;
      for (const Row& row : occupied) {
        const int y = row.y - dy;
        const int z = row.z - dz;
        if (y < 0 || z < 0 || y >= height_ || z >= height_) continue;
        const std::uint64_t bits = pattern.row(y, z);
        if (bits == 0) continue;
        at_most += std::min(row.count, __builtin_popcountll(bits));
        pairs.emplace_back(row.bits, bits);
      }
      if (at_most <= std::max(best[r].score, min_score))
        continue;  // no shift along the axis can do better
      for (int dx = -reach_x; dx <= reach_x; ++dx) {
        int score = 0;
        for (const auto& [from_data, from_template] : pairs) {
          score += __builtin_popcountll(from_data & shifted(from_template, dx));
        }
        if (score > best[r].score) best[r] = {static_cast<int>(r), {dx, dy, dz}, score};
      }
    }
  }
  return best;
}

}  // namespace berth::estimator
