// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/target_model.h"

#include <cstdlib>

#include "common/core/error.h"
#include "common/core/file.h"
#include "estimator/model/model_file.h"

namespace berth::estimator {

TargetModel::TargetModel(Target target_, const ModelOptions& options_)
    : target(std::move(target_)), options(options_), caster(target.mesh, RayCaster::Edges::quick) {
  const Box box = bounding_box(target.mesh);
  centre = box.centre();
  for (const Vector3d& v : target.mesh.vertices) radius = std::max(radius, (v - centre).norm());
}

std::shared_ptr<const TargetModel> compile_target_model(const Target& target,
                                                        const ModelOptions& options) {
  auto model = std::make_shared<TargetModel>(target, options);
  model->surface = find_visible_surface(target.mesh, model->caster, options.surface_samples);
  if (model->surface.samples.empty()) {
    throw InputError("target '" + target.name +
                     "': found no surface that can be seen from outside");
  }
  const double length = bounding_box(target.mesh).size().maxCoeff();
  model->canonical = find_canonical_pose(model->surface.samples);
  model->templates = VoxelTemplates(model->surface.samples, model->canonical,
                                    options.template_rotations, options.template_voxels);
  model->grid = ClosestPointGrid(target.mesh, model->surface.triangles,
                                 options.grid_margin * length, options.grid_voxels);
  model->regions = find_scan_regions(model->surface.samples, options.region_radius * length);
  model->views = make_view_templates(model->caster, model->centre, model->radius, options.views);
  model->symmetries = measure_symmetries(target.mesh, model->surface, model->grid, target.length);
  return model;
}

std::filesystem::path default_cache_directory() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache == '/') {
    return std::filesystem::path(cache) / "berth";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return std::filesystem::path(home) / ".cache" / "berth";
  }
  return temporary_directory() / "berth-cache";
}

std::shared_ptr<const TargetModel> load_target_model(const Target& target,
                                                     const ModelOptions& options,
                                                     const std::filesystem::path& cache,
                                                     bool* loaded) {
  const std::filesystem::path path = cache / ModelFile::name(target, options);
  auto model = std::make_shared<TargetModel>(target, options);
  const bool found = ModelFile::read(path, *model);
  if (loaded != nullptr) *loaded = found;
  if (found) return model;
  auto compiled = compile_target_model(target, options);
  ModelFile::write(path, *compiled);
  return compiled;
}

}  // namespace berth::estimator
