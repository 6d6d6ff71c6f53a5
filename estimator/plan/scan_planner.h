// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/beam/scan.h"
#include "estimator/beam/target_scene.h"
#include "estimator/model/target_model.h"
#include "estimator/plan/windows.h"

namespace berth::estimator {

/// The scan strategies of the paper's section 5.3.1, and windows chosen by what they would add to
/// the information about the pose (estimator/plan/information_planner.h).
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
/// @return false for a name that is none of them.
bool parse_scan_strategy(const std::string& name, ScanStrategy& strategy);

/// Chooses scan windows (paper, section 4.5): the model is placed in the pose predicted for the
/// next scan, and those of its regions that are visible there share the beams.
class ScanPlanner {
 public:
  ScanPlanner(const TargetModel& model, const FieldOfView& field, const PlannerOptions& options)
      : model_(model), scene_(model.target), field_(field), options_(options) {}

  /// pose: predicted T_sensor_model; sigma: standard deviation of a point of the target about it,
  /// m. returns: wanted of the scan; the paper's strategies ask for more beams, as many as pass the
  /// predicted target by; information planning takes it for the beams that it may spend. Empty when
  /// the target is out of view.
  std::vector<Window> plan(const Pose& pose, double sigma, ScanStrategy strategy,
                           int returns) const;

  /// One window around the whole target in all of the poses; nothing when it is out of view.
  std::vector<Window> around(const std::vector<Pose>& poses, double margin_m, int beams) const;
  /// The same around one pose, in which about so many beams return.
  std::vector<Window> outline(const Pose& pose, double margin_m, int returns) const;
  /// The whole field of view.
  Window everything(int beams) const;

  const TargetScene& scene() const { return scene_; }
  /// Regions that the LIDAR sees in this pose: by the visibility stored with the model, then by a
  /// ray.
  std::vector<const ScanRegion*> visible(const Pose& pose, ScanRegion::Kind kind) const;

 private:
  std::vector<Window> windows_of(const Pose& pose, double sigma, ScanStrategy strategy,
                                 int beams) const;
  /// Moves beams, but for the equal share, to the windows of these that add most to the others.
  void share_out(const Pose& pose, double sigma, const std::vector<Window>& others,
                 std::vector<Window>& windows) const;
  /// More beams in all windows, so that as many return as there are beams now.
  void make_up_for_misses(const Pose& pose, std::vector<Window>& windows) const;
  /// Widens a window in which the LIDAR could not put its beams a minimum step apart.
  void make_room(Window& window) const;
  /// Cuts a window to the field of view. @return the share of it that is left.
  double clip(Window& window) const;
  void add(const Pose& pose, double margin, ScanRegion::Kind kind, int beams,
           std::vector<Window>& windows) const;

  const TargetModel& model_;
  TargetScene scene_;
  FieldOfView field_;
  const PlannerOptions& options_;
};

}  // namespace berth::estimator
