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

/// What a ray meets first. Model frame.
struct SurfaceHit {
  double range = std::numeric_limits<double>::infinity();  ///< m along the ray; infinite: nothing
  Vector3d normal = Vector3d::Zero();                      ///< unit, against the ray
  std::uint32_t face = 0;                                  ///< see TargetScene

  bool met() const { return range < std::numeric_limits<double>::infinity(); }
};

/// m: an edge occludes what is so much farther than its face; three sigmas of a range.
constexpr double edge_depth = 0.03;

/// A place on an occluding edge: on one side of it a ray meets the front face, on the other it
/// passes. Model frame, joints as they stood when it was found.
struct RimSample {
  Vector3d point;     ///< m
  Vector3d outward;   ///< unit, across edge and line of sight, away from the front face
  SurfaceHit front;   ///< just inside
  SurfaceHit behind;  ///< just outside: not met where a ray that passes meets nothing
};

/// A target whose jointed parts can be turned: ray casting and occluding edges. Faces are numbered
/// as the triangles of the target's mesh. The rigid part and every jointed part are meshes of their
/// own, so that a turn moves rays instead of rebuilding anything. Angles are those of Joint, in the
/// order of joints(), 0: as the mesh shows it. const and safe from several threads.
class TargetScene {
 public:
  explicit TargetScene(const Target& target);

  /// Of the parts that turn, in the order of Target::parts.
  const std::vector<Joint>& joints() const { return joints_; }
  /// Index into joints() of the joint that turns a face; negative: it is of the rigid part.
  int joint_of(std::uint32_t face) const { return joint_of_[face]; }
  /// m, of the sphere about a point (model frame) that holds the target, however far joints turn.
  double radius_about(const Vector3d& centre) const;

  /// What rays meet first, nearer than max_range (m).
  void cast(const std::vector<double>& angles, std::span<const Ray> rays, double max_range,
            std::span<SurfaceHit> hits) const;
  /// Where the line of a ray meets a face's plane, whatever else is there. The range is infinite
  /// where it runs along the plane, and may be negative.
  SurfaceHit meet(const std::vector<double>& angles, const Ray& ray, std::uint32_t face) const;

  /// Occluding edges as seen from `eye`, by samples `spacing` radians apart within the cone about
  /// `axis` (unit) of that cosine. An edge occludes when the third corners of all its triangles lie
  /// on one side of the plane through it and the eye, whatever their winding; of those, places are
  /// kept past which a ray goes on by more than `depth` (m).
  std::vector<RimSample> rims(const std::vector<double>& angles, const Vector3d& eye,
                              const Vector3d& axis, double cone_cosine, double spacing,
                              double depth) const;

 private:
  struct Edge {
    std::uint32_t from, to;      // vertices
    std::uint32_t first, count;  // of its triangles, in sides_
  };
  /// A triangle at an edge, and whether the edge runs about it as its corners do.
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
