// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "common/bus/loop.h"
#include "drivers/simulated/receiver/scene.h"

/// A plate square to the boresight, 2 m wide, nothing or a wall behind it. It closes in at a speed.
class WallScene final : public berth::Scene {
 public:
  explicit WallScene(berth::Utime start) : start_(start) {}

  using berth::Scene::cast;
  void cast(berth::Utime t, std::span<const berth::Ray> rays, double max_range,
            std::span<berth::SceneHit> hits) override {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const berth::Ray& ray = rays[i];
      hits[i] = {};
      for (const double depth : {0.0, wall_behind}) {
        const double range = (distance_at(t) + depth - ray.origin.z()) / ray.direction.z();
        const bool on_plate =
            std::abs(ray.origin.x() + range * ray.direction.x()) < half_width || depth > 0;
        if (range >= max_range || !on_plate) continue;
        hits[i] = {range, ray.direction.z(), -berth::Vector3d::UnitZ(), material, true};
        break;
      }
    }
  }
  berth::Sunlight sunlight(berth::Utime) override { return sun; }
  double distance_at(berth::Utime t) const { return distance - speed * berth::seconds(t - start_); }

  double distance = 5;
  double speed = 0;
  double half_width = 1;
  double wall_behind = 0;  ///< m behind the plate, endless; 0: none
  berth::Material material;
  berth::Sunlight sun;

 private:
  berth::Utime start_;
};
