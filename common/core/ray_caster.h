// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>

#include "common/core/mesh.h"

namespace berth {

struct Ray {
  Vector3d origin = Vector3d::Zero();
  Vector3d direction = Vector3d::UnitZ();  ///< unit
};

struct RayHit {
  double range = 0;                    ///< m along the ray
  std::uint32_t triangle = 0;          ///< index in the mesh
  Vector3d normal = Vector3d::Zero();  ///< unit, turned against the ray
};

/// Casts rays at one rigid mesh, in the mesh's own frame (transform the ray, not the mesh). Both
/// sides of a triangle are hit. Built once; casting is const and safe from several threads. Embree
/// 3, pinned to AVX2 and single-threaded construction so that the same bits come out everywhere.
class RayCaster {
 public:
  enum class Edges {
    closed,  ///< no ray passes between two triangles that share an edge
    quick    ///< a tenth faster or more; a ray aimed exactly at such an edge may pass
  };

  explicit RayCaster(const Mesh& mesh, Edges edges = Edges::closed);
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// The first hit nearer than max_range (m). @return false when there is none.
  bool cast(const Ray& ray, double max_range, RayHit& hit) const;
  /// Many rays in packets of eight: several times faster where neighbours in the list are
  /// neighbours in space. hits: as many as rays; the range is infinite where there is none nearer
  /// than max_range.
  void cast(std::span<const Ray> rays, double max_range, std::span<RayHit> hits) const;
  /// Where the line of a ray meets a triangle's plane, other surfaces ignored: hit. The range is
  /// infinite where it runs along the plane, and may be negative.
  void meet(const Ray& ray, std::uint32_t triangle, RayHit& hit) const;
  /// The plane of a triangle.
  struct Plane {
    Vector3d normal;  ///< unit, of either sign
    Vector3d corner;
  };
  const Plane& plane(std::uint32_t triangle) const;
  /// Whether anything lies between the origin and max_range.
  bool occluded(const Ray& ray, double max_range) const;
  /// Point of the mesh nearest to a point of the mesh frame, and its triangle.
  Vector3d nearest(const Vector3d& point, std::uint32_t* triangle = nullptr) const;

  const Box& bounds() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
