// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/scene.h"

#include <algorithm>

namespace berth {

void MeshScene::place(std::int64_t utime, const Pose& pose, const Velocity& velocity) {
  utime_ = now_ = utime;
  pose_ = pose;
  velocity_ = velocity;
  to_model_ = pose.inverse();
}

Pose MeshScene::pose_at(std::int64_t utime) const {
  return moved(pose_, velocity_, 1e-6 * static_cast<double>(utime - utime_));
}

void MeshScene::cast(std::int64_t utime, std::span<const Ray> rays, double max_range,
                     std::span<SceneHit> hits) {
  if (utime != now_) {
    now_ = utime;
    to_model_ = pose_at(utime).inverse();
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Ray& ray = rays[i];
    SceneHit& out = hits[i];
    out = {};
    double nearest = max_range;
    RayHit hit;
    if (target_->cast({to_model_ * ray.origin, to_model_.rotation * ray.direction}, nearest, hit)) {
      nearest = out.range = hit.range;
      out.normal = to_model_.rotation.conjugate() * hit.normal;
      out.material = materials[material_of.empty() ? 0 : material_of[hit.triangle]];
      out.target = true;
    }
    for (const auto& clutter : clutter_) {
      if (!clutter->cast(ray, nearest, hit)) continue;
      nearest = hit.range;
      out = {hit.range, 0, hit.normal, {}, false};
    }
    if (out.met()) out.cosine = std::clamp(-ray.direction.dot(out.normal), 0.0, 1.0);
  }
}

}  // namespace berth
