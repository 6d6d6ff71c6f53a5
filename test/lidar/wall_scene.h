// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "drivers/simulated/scene.h"

/// A plate square to the boresight, 2 m wide, nothing around it. It closes in at a speed.
class WallScene final : public berth::Scene {
 public:
  explicit WallScene(berth::Utime start) : start_(start) {}

  bool cast(berth::Utime t, const berth::Vector3d& direction, double max_range,
            berth::SceneHit& hit) override {
    hit.range = distance_at(t) / direction.z();
    hit.incidence = std::acos(direction.z());
    hit.reflectivity = 0.5;
    hit.normal = -berth::Vector3d::UnitZ();
    hit.target = true;
    return hit.range < max_range && std::abs(hit.range * direction.x()) < 1;
  }
  berth::Sunlight sunlight(berth::Utime) override { return sun; }
  double distance_at(berth::Utime t) const { return distance - speed * berth::seconds(t - start_); }

  double distance = 5;
  double speed = 0;
  berth::Sunlight sun;

 private:
  berth::Utime start_;
};
