// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "common/core/ray_caster.h"
#include "common/targets/target.h"

namespace berth::estimator {

/// The first intersection of a ray. Model frame.
struct SurfaceHit {
  double range =
      std::numeric_limits<double>::infinity();  ///< m along the ray; infinite: no intersection
  Vector3d normal = Vector3d::Zero();           ///< unit, against the ray
  std::uint32_t face = 0;                       ///< numbered as in TargetScene

  bool met() const { return range < std::numeric_limits<double>::infinity(); }
};

/// m: an edge occludes what is farther than its face by more than this: three sigmas of a range.
constexpr double edge_depth = 0.03;

/// A point of an occluding edge, where a ray on one side meets the front face and a ray on the
/// other side passes. Model frame, joints as they stood when the point was sampled.
struct RimSample {
  Vector3d point;     ///< m
  Vector3d outward;   ///< unit, normal to edge and line of sight, away from the front face
  SurfaceHit front;   ///< just inside
  SurfaceHit behind;  ///< just outside; no intersection where the passing ray meets nothing
};

/// Ray casting and occluding edges of a target whose jointed parts can be turned. Faces are
/// numbered as the triangles of the target's mesh. The rigid part and every jointed part have a
/// mesh of their own: a joint's angle transforms rays instead of rebuilding a mesh. Angles are
/// those of Joint, in the order of joints(); at 0 a part stands as in the mesh. const and
/// thread-safe.
class TargetScene {
 public:
  explicit TargetScene(const Target& target);

  /// Of the jointed parts, in the order of Target::parts.
  const std::vector<Joint>& joints() const { return joints_; }
  /// Index into joints() of the joint that turns a face; negative for the rigid part.
  int joint_of(std::uint32_t face) const { return joint_of_[face]; }
  /// m: radius of the sphere about a point (model frame) that holds the target at any joint angle.
  double radius_about(const Vector3d& centre) const;

  /// First intersections of rays, nearer than max_range (m).
  void cast(const std::vector<double>& angles, std::span<const Ray> rays, double max_range,
            std::span<SurfaceHit> hits) const;
  /// Intersection of a ray's line with a face's plane, whatever occludes it. The range is infinite
  /// for a line parallel to the plane, and may be negative.
  SurfaceHit meet(const std::vector<double>& angles, const Ray& ray, std::uint32_t face) const;

  /// Samples of the occluding edges as seen from `eye`, `spacing` radians apart, within the cone
  /// about `axis` (unit) with that cosine. An edge occludes when the third corners of all its
  /// triangles lie on one side of the plane through it and the eye, whatever their winding. Samples
  /// are kept where a passing ray goes on by more than `depth` (m).
  std::vector<RimSample> rims(const std::vector<double>& angles, const Vector3d& eye,
                              const Vector3d& axis, double cone_cosine, double spacing,
                              double depth) const;

 private:
  struct Edge {
    std::uint32_t from, to;      // vertices
    std::uint32_t first, count;  // of its triangles, in sides_
  };
  /// A triangle at an edge, and whether the edge's direction agrees with the triangle's winding.
  struct Side {
    std::uint32_t triangle;
    bool along;
  };
  struct Body {
    int joint = -1;
    RayCaster caster;
    std::vector<std::uint32_t> faces;  // of the target's mesh
    std::vector<Edge> edges;
  };
  void add_body(const Target& target, int joint, const std::vector<std::uint32_t>& faces);
  Pose placed(const Body& body, const std::vector<double>& angles) const;

  std::vector<Joint> joints_;
  std::vector<std::int8_t> joint_of_;
  std::vector<std::uint32_t> in_body_;  // of each face, its number there
  std::vector<Vector3d> vertices_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Side> sides_;
  std::vector<Body> bodies_;
};

}  // namespace berth::estimator
