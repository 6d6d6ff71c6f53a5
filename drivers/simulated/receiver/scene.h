// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "common/core/ray_caster.h"
#include "drivers/simulated/receiver/material.h"

namespace berth {

/// First hit of a ray.
struct SceneHit {
  double range = std::numeric_limits<double>::infinity();  ///< m along the ray; infinite: nothing
  double cosine = 0;                   ///< of the incidence: between ray and normal, 0..1
  Vector3d normal = Vector3d::Zero();  ///< unit, turned against the ray, sensor frame
  Material material;
  bool target = false;  ///< else arms, mount or room

  bool met() const { return range < std::numeric_limits<double>::infinity(); }
};

/// The lamps as the sensor has them at one time.
struct Sunlight {
  double level = 0;                       ///< of the sun lamp, 0 off .. 1 full
  Vector3d towards = -Vector3d::UnitZ();  ///< unit, to the sun lamp, sensor frame
  bool in_view = false;                   ///< nothing occludes the sun lamp
  double albedo = 0;                      ///< level of the albedo lamp, which lights from all sides

  bool dark() const { return level <= 0 && albedo <= 0; }
};

/// The simulated world as the LIDAR sees it. Times: us, as of messages.
class Scene {
 public:
  virtual ~Scene() = default;
  /// First hits, at a time, of a few rays close together. Rays: sensor frame, from about its
  /// origin. hits: as many; infinitely far where nothing is nearer than max_range (m).
  virtual void cast(std::int64_t utime, std::span<const Ray> rays, double max_range,
                    std::span<SceneHit> hits) = 0;
  /// One ray from the sensor's origin. @return false when nothing is met.
  bool cast(std::int64_t utime, const Vector3d& direction, double max_range, SceneHit& hit) {
    const Ray ray{Vector3d::Zero(), direction};
    cast(utime, {&ray, 1}, max_range, {&hit, 1});
    return hit.met();
  }
  /// Announces rays up to this time, in ascending order: motion may be interpolated until then.
  virtual void prepare(std::int64_t /*last*/) {}
  virtual Sunlight sunlight(std::int64_t /*utime*/) { return {}; }
};

/// A rigid target that moves evenly in empty space before the sensor, and things at rest
/// in the sensor frame.
class MeshScene final : public Scene {
 public:
  explicit MeshScene(std::shared_ptr<const RayCaster> target) : target_(std::move(target)) {}
  explicit MeshScene(const Mesh& target) : MeshScene(std::make_shared<RayCaster>(target)) {}

  /// Something else, sensor frame.
  void add_clutter(const Mesh& mesh) { clutter_.push_back(std::make_shared<RayCaster>(mesh)); }
  /// T_sensor_model at a time, and how it goes on from there (velocity: sensor frame).
  void place(std::int64_t utime, const Pose& pose, const Velocity& velocity = {});
  Pose pose_at(std::int64_t utime) const;

  using Scene::cast;
  void cast(std::int64_t utime, std::span<const Ray> rays, double max_range,
            std::span<SceneHit> hits) override;

  const RayCaster& target() const { return *target_; }

  std::vector<Material> materials{1};      ///< of the target's parts
  std::vector<std::uint16_t> material_of;  ///< each triangle of it; empty: the first

 private:
  std::shared_ptr<const RayCaster> target_;
  std::vector<std::shared_ptr<const RayCaster>> clutter_;
  std::int64_t utime_ = 0;
  Pose pose_;
  Velocity velocity_;
  std::int64_t now_ = 0;  // of the pose in
  Pose to_model_;
};

}  // namespace berth
