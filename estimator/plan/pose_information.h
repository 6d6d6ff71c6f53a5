// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "common/core/beam_model.h"
#include "estimator/beam/scan.h"
#include "estimator/beam/target_scene.h"
#include "estimator/model/target_model.h"
#include "estimator/plan/windows.h"

namespace berth::estimator {

/// What a beam says of the pose. The surface errs alike in a patch, as wide as its correlation
/// length: n returns of one say as much as n / (1 + n alike) that err each by itself.
struct BeamReturn {
  /// Derivative of the range by the parameters over its standard deviation: a return adds root *
  /// root^T to the Fisher information (1/m^2). Zero where none comes back, or from what is not
  /// worth scanning.
  Vector6d root = Vector6d::Zero();
  bool met = false;         ///< the target
  double alike = 0;         ///< variance that the patch has in common, over the return's own
  double patch_area = 1;    ///< m^2
  std::uint64_t patch = 0;  ///< equal for neighbours

  /// The same between returns of an area (m^2) that may hold several patches.
  double alike_within(double area) const { return alike * std::min(1.0, patch_area / area); }
};

/// A piece of an occluding edge. Beams that pass it tell where it is across the edge and the line
/// of sight: n beams in a window of area A (m^2, at its range) add n / A * root * root^T, since
/// whether a beam returns from before the edge or from behind it, integrated over the beams'
/// places, has the information 1.806 length / width.
struct EdgePiece {
  Vector3d point;  ///< model frame
  Vector6d root;   ///< of the same parameters; 1/m^2 of information, times m^2
  /// m^2: over A, as of a BeamReturn.
  double alike = 0;
  std::uint64_t patch = 0;
};

/// The model in a pose, as a LIDAR at the origin sees it, and what each return from it says of the
/// pose. The pose's six parameters are all lengths here: translation, and rotation vector times the
/// target's half length, both in the axes of the model, which changes no trace.
class PoseView {
 public:
  /// All must outlive the view. scene: for its edges; null: they are not looked at.
  PoseView(const TargetModel& model, const TargetScene* scene, const BeamModel& beam,
           const PlannerOptions& options, const Pose& pose);
  /// The target a little elsewhere: what edges it shows is the same.
  PoseView moved_to(const Pose& pose) const;

  /// Of beams of these directions (unit, sensor axes). Several times faster where neighbours in the
  /// list are neighbours in space. returns: as many as directions.
  void returns(std::span<const Vector3d> directions, std::span<BeamReturn> returns) const;

  const std::vector<EdgePiece>& edges() const { return edges_; }
  /// Which edges lie in a window: of each, its index.
  template <class Each>
  void edges_in(const Window& window, Each each) const {
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      if (std::abs(edge_angles_[i][0] - window.azimuth) <= 0.5 * window.width &&
          std::abs(edge_angles_[i][1] - window.elevation) <= 0.5 * window.height) {
        each(i);
      }
    }
  }
  const std::array<double, 2>& edge_angles(std::size_t i) const { return edge_angles_[i]; }
  /// m^2 that a window of this size (rad) covers at the target.
  double area(double width, double height) const {
    return std::max(1e-12, range_ * range_ * width * height);
  }
  double area(const Window& window) const { return area(window.width, window.height); }

  /// Covariance of the pose as berth::perturbed (m, rad, sensor axes), from that of the parameters.
  Matrix6d pose_covariance(const Matrix6d& scaled) const;

 private:
  void look_at_edges(const TargetScene& scene);
  void place_edges(const Pose& pose);
  double surface_sigma(const TargetPart& part) const;

  const TargetModel& model_;
  const BeamModel& beam_;
  Pose to_model_;
  Matrix3d rotation_;  // of to_model_
  double far_;
  const PlannerOptions& options_;
  double range_;
  std::vector<EdgePiece> edges_;
  std::vector<std::array<double, 2>> edge_angles_;  // azimuth and elevation
};

/// Fisher information of the windows' beams together, the surface's patches marginalised. returns:
/// how many come back.
Matrix6d scan_information(const PoseView& view, const std::vector<Window>& windows,
                          int* returns = nullptr);

}  // namespace berth::estimator
