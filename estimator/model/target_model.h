// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/core/ray_caster.h"
#include "common/targets/target.h"
#include "estimator/model/closest_point_grid.h"
#include "estimator/model/scan_regions.h"
#include "estimator/model/symmetry.h"
#include "estimator/model/view_templates.h"
#include "estimator/model/voxel_templates.h"

namespace berth::estimator {

/// Resolution of a compiled model.
struct ModelOptions {
  int surface_samples = 12000;
  int template_rotations = 36;
  int template_voxels = 32;  ///< along the major axis; at most 48
  int grid_voxels = 600000;
  double grid_margin = 0.10;     ///< of the length
  double region_radius = 0.035;  ///< of the length
  int views = 320;               ///< templates for acquisition
};

/// Everything about a target that is computed before a run: its visible surface, canonical pose,
/// voxel templates, closest points and scan regions (paper, sections 4.3 to 4.5), templates of its
/// views, and its symmetries.
struct TargetModel {
  Target target;
  ModelOptions options;
  VisibleSurface surface;
  CanonicalPose canonical;
  VoxelTemplates templates;
  ClosestPointGrid grid;
  std::vector<ScanRegion> regions;
  std::vector<ViewTemplate> views;
  Symmetries symmetries;

  // Not stored; made from the mesh.
  RayCaster caster;
  Vector3d centre = Vector3d::Zero();  ///< of the bounding box, model frame
  double radius = 0;                   ///< of the sphere about the centre that holds the mesh, m

  TargetModel(Target target_, const ModelOptions& options_);
};

/// Compiles a model in some seconds. @throws InputError when no surface of it is visible.
std::shared_ptr<const TargetModel> compile_target_model(const Target& target,
                                                        const ModelOptions& options);

/// $XDG_CACHE_HOME/berth, else ~/.cache/berth, else (no home) a directory for temporary files.
std::filesystem::path default_cache_directory();

/// The model from the cache; else compiled, then cached. The file is named by the mesh's content,
/// the options and the format's version, and written atomically; a damaged one is replaced. A cache
/// that cannot be written is no error. loaded: set to whether the cache held the model.
std::shared_ptr<const TargetModel> load_target_model(const Target& target,
                                                     const ModelOptions& options,
                                                     const std::filesystem::path& cache,
                                                     bool* loaded = nullptr);

}  // namespace berth::estimator
