// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "drivers/simulated/receiver/scene.h"

namespace berth {

/// A rigid target that moves evenly in empty space before the sensor, and things that stand still
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
