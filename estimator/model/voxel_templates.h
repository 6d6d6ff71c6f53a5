// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/model/visible_surface.h"

namespace berth::estimator {

/// A target's canonical pose (paper, section 4.3): major axis on x, minor axis on y, centroid of
/// the visible surface at the origin.
struct CanonicalPose {
  Pose pose;               ///< T_canonical_model
  Vector3d spread;         ///< standard deviations along major, middle, minor axis, m
  double half_length = 0;  ///< largest |x| of the surface, m
  double radius = 0;       ///< largest distance from the x axis, m

  /// Standard deviation along the major axis over that along the middle axis.
  double elongation() const { return spread[0] / spread[1]; }
};

CanonicalPose find_canonical_pose(const std::vector<SurfaceSample>& samples);

/// Occupied voxels, one 64-bit word per (y, z) row along x. Centred: voxel (32, height/2, height/2)
/// holds the origin.
struct VoxelRows {
  int height = 0;
  std::vector<std::uint64_t> rows;  ///< [z * height + y]

  explicit VoxelRows(int height_ = 0)
      : height(height_),
        rows(static_cast<std::size_t>(height_) * static_cast<std::size_t>(height_)) {}
  std::uint64_t& row(int y, int z) { return rows[index(y, z)]; }
  std::uint64_t row(int y, int z) const { return rows[index(y, z)]; }
  /// Points outside are ignored.
  void occupy(const Vector3d& point, double cell);

 private:
  std::size_t index(int y, int z) const {
    return static_cast<std::size_t>(z) * static_cast<std::size_t>(height) +
           static_cast<std::size_t>(y);
  }
};

/// The best fit of a template.
struct Correlation {
  int rotation = 0;            ///< index of the template
  std::array<int, 3> shift{};  ///< voxels by which the template is shifted onto the data
  int score = 0;               ///< occupied voxels in common
};

/// Binary templates of the model at n rotations about its major axis (paper, section 4.3), and the
/// exhaustive correlation with voxelised data over all rotations and translations.
class VoxelTemplates {
 public:
  VoxelTemplates() = default;
  VoxelTemplates(const std::vector<SurfaceSample>& samples, const CanonicalPose& canonical,
                 int rotations, int voxels_along_axis);

  double cell() const { return cell_; }
  int rotations() const { return static_cast<int>(templates_.size()); }
  /// About +x of the canonical frame, rad.
  double angle(int rotation) const;

  /// Correlates points given in a frame whose x axis is the data's major axis and whose origin is
  /// its centroid. The best translation of each rotation, within shifts of `reach_x` along and
  /// `reach_yz` across the axis (voxels).
  std::vector<Correlation> correlate(const std::vector<Vector3d>& points, int reach_x,
                                     int reach_yz) const;

 private:
  friend class ModelFile;
  double cell_ = 1;
  int height_ = 0;
  std::vector<VoxelRows> templates_;
};

}  // namespace berth::estimator
