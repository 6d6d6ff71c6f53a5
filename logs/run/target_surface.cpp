// SPDX-License-Identifier: BSD-3-Clause
#include "logs/run/target_surface.h"

#include <memory>

#include "common/core/error.h"
#include "common/core/ray_caster.h"

namespace berth::logs {

NearestPoint nearest_point_on(const Target& target) {
  auto caster = std::make_shared<const RayCaster>(target.mesh);
  return [caster](const Vector3d& point) { return caster->nearest(point); };
}

NearestPoint nearest_point_of_run(const run_info_t& info, const std::filesystem::path& directory,
                                  std::string& why) {
  try {
    const bool kept = std::filesystem::exists(directory / info.target);
    const Target target =
        load_target(kept ? (directory / info.target).string() : info.target, info.target_length_m);
    if (target.hash == info.target_hash) return nearest_point_on(target);
    why = "target '" + info.target + "' is not the one of the run: its hash differs";
  } catch (const InputError& e) {
    why = e.what();
  }
  return {};
}

}  // namespace berth::logs
