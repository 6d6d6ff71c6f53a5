// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/target_surface.h"

#include <memory>

#include "common/core/error.h"
#include "common/core/ray_caster.h"

namespace berth::evaluation {

std::string target_name_of_run(const run_info_t& info, const std::filesystem::path& directory) {
  const std::filesystem::path kept = directory / info.target;
  if (std::filesystem::exists(kept)) return kept.string();
  const std::string name = std::filesystem::path(info.target).filename().string();
  return is_target_name(name) ? name : info.target;
}

Target target_of_run(const run_info_t& info, const std::filesystem::path& directory) {
  return load_target(target_name_of_run(info, directory), info.target_length_m);
}

SymmetryGroup symmetry_of_run(const run_info_t& info, std::string* why) {
  try {
    for (const attachment_t& attachment : info.attachments) {
      if (attachment.name != symmetry_file) continue;
      return read_symmetry(attachment.content, std::string(symmetry_file) + " in RUN_INFO");
    }
  } catch (const InputError& e) {
    if (why != nullptr) *why = e.what();
  }
  return {};
}

NearestPoint nearest_point_on(const Target& target) {
  auto caster = std::make_shared<const RayCaster>(target.mesh);
  NearestPoint nearest = [caster](const Vector3d& point) { return caster->nearest(point); };
  nearest.rays = std::move(caster);
  return nearest;
}

NearestPoint nearest_point_of_run(const run_info_t& info, const std::filesystem::path& directory,
                                  std::string& why) {
  try {
    const Target target = target_of_run(info, directory);
    if (target.hash == info.target_hash) return nearest_point_on(target);
    why = "target '" + info.target + "' is not the one of the run: its hash differs";
  } catch (const std::exception& e) {
    why = e.what();
  }
  return {};
}

}  // namespace berth::evaluation
