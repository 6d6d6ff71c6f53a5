// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/beam/scan.h"
#include "estimator/beam/target_scene.h"
#include "estimator/model/target_model.h"
#include "estimator/plan/windows.h"

namespace berth::estimator {

/// The scan strategies of the paper's section 5.3.1, and information planning
/// (information_planner.h).
enum class ScanStrategy {
  dense,
  sparse,
  corners,
  edges,
  corners_sparse,
  edges_sparse,
  information
};

/// "dense", "sparse", "corners", "edges", "corners+sparse", "edges+sparse", "information".
const std::vector<std::string>& scan_strategy_names();
/// @return false for an unknown name.
bool parse_scan_strategy(const std::string& name, ScanStrategy& strategy);

/// Chooses scan windows (paper, section 4.5): the model is placed in the pose predicted for the
/// next scan, and its regions visible there share the beams.
class ScanPlanner {
 public:
  ScanPlanner(const TargetModel& model, const FieldOfView& field, const PlannerOptions& options)
      : model_(model), scene_(model.target), field_(field), options_(options) {}

  /// Empty when the target is out of view.
  /// @param pose predicted T_sensor_model
  /// @param sigma m, standard deviation of a point of the target
  /// @param returns number of returns required; the paper's strategies add beams for those that
  /// will pass the target, information planning takes it for the number of beams
  std::vector<Window> plan(const Pose& pose, double sigma, ScanStrategy strategy,
                           int returns) const;

  /// One window around the whole target in all of the poses; empty when it is out of view.
  std::vector<Window> around(const std::vector<Pose>& poses, double margin_m, int beams) const;
  /// The same around one pose, with beams for about so many returns.
  std::vector<Window> outline(const Pose& pose, double margin_m, int returns) const;
  /// The whole field of view.
  Window everything(int beams) const;

  const TargetScene& scene() const { return scene_; }
  /// Regions visible to the LIDAR in this pose: by the visibility stored with the model, then by a
  /// ray.
  std::vector<const ScanRegion*> visible(const Pose& pose, ScanRegion::Kind kind) const;

 private:
  std::vector<Window> windows_of(const Pose& pose, double sigma, ScanStrategy strategy,
                                 int beams) const;
  /// Distributes the beams beyond the equal share by their information, given the other windows.
  void redistribute(const Pose& pose, double sigma, const std::vector<Window>& others,
                    std::vector<Window>& windows) const;
  /// Adds beams to all windows so that as many return as there are beams now.
  void compensate_misses(const Pose& pose, std::vector<Window>& windows) const;
  /// Enlarges a window in which beams would be closer than the LIDAR's minimum step.
  void enforce_minimum_step(Window& window) const;
  /// Clips a window to the field of view. @return the share of it that is left.
  double clip(Window& window) const;
  void add(const Pose& pose, double margin, ScanRegion::Kind kind, int beams,
           std::vector<Window>& windows) const;

  const TargetModel& model_;
  TargetScene scene_;
  FieldOfView field_;
  const PlannerOptions& options_;
};

}  // namespace berth::estimator
