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

/// How finely a model is compiled.
struct ModelOptions {
  int surface_samples = 12000;
  int template_rotations = 36;
  int template_voxels = 32;  ///< along the major axis; at most 48
  int grid_voxels = 600000;
  double grid_margin = 0.10;     ///< of the length
  double region_radius = 0.035;  ///< of the length
  int views = 320;               ///< from which acquisition knows the target
};

/// Everything about a target that is worked out before it is met: what can be seen of it, its
/// canonical pose, voxel templates, closest points and scan regions (paper, sections 4.3 to 4.5),
/// its views from all sides and its symmetries.
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

  // Not stored, made from the mesh.
  RayCaster caster;
  Vector3d centre = Vector3d::Zero();  ///< of the bounding box, model frame
  double radius = 0;                   ///< of the sphere about it that holds the mesh, m

  TargetModel(Target target_, const ModelOptions& options_);
};

/// Compiles a model: seconds. @throws InputError when no surface of it can be seen.
std::shared_ptr<const TargetModel> compile_target_model(const Target& target,
                                                        const ModelOptions& options);

/// $XDG_CACHE_HOME/berth, else ~/.cache/berth, else (no home) a directory for temporary files.
std::filesystem::path default_cache_directory();

/// The model from the cache, or compiled and then put there. The file is named by the mesh's
/// content, the options and the format's version, and is written whole or not at all; a damaged one
/// is replaced. A cache that cannot be written is no error. loaded: tells whether the cache had it.
std::shared_ptr<const TargetModel> load_target_model(const Target& target,
                                                     const ModelOptions& options,
                                                     const std::filesystem::path& cache,
                                                     bool* loaded = nullptr);

}  // namespace berth::estimator
