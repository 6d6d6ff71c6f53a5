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

/// Information of one return on the pose. Surface errors are correlated within a patch as wide as
/// the correlation length: n returns of a patch have the information of n / (1 + n correlation)
/// independent ones.
struct BeamReturn {
  /// Derivative of the range by the parameters over its standard deviation: a return adds root *
  /// root^T to the Fisher information (1/m^2). Zero without return, and on parts that are not to be
  /// scanned.
  Vector6d root = Vector6d::Zero();
  bool met = false;  ///< the beam meets the target
  /// m^2: over A, as of a BeamReturn.
  double correlation = 0;   ///< variance shared within the patch over the return's own
  double patch_area = 1;    ///< m^2
  std::uint64_t patch = 0;  ///< equal for neighbours

  /// The same for returns spread over an area (m^2) that may hold several patches.
  double correlation_within(double area) const {
    return correlation * std::min(1.0, patch_area / area);
  }
};

/// A piece of an occluding edge. Beams that pass near it measure its position across the edge and
/// the line of sight: whether a beam returns from before or behind the edge, integrated over the
/// beams' positions, has the information 1.806 length / width. n beams in a window of area A (m^2,
/// at its range) add n / A * root * root^T.
struct EdgePiece {
  Vector3d point;  ///< model frame
  Vector6d root;   ///< in the same parameters; root * root^T in 1/m^2 times m^2
  /// m^2: over A, as of a BeamReturn.
  double correlation = 0;
  std::uint64_t patch = 0;
};

/// The model in a pose, as seen by a LIDAR at the origin, and the information of its returns. The
/// six parameters are lengths: translation, and rotation vector times the target's half length, in
/// the model's axes, which leaves traces unchanged.
class PoseView {
 public:
  /// All must outlive the view. scene: for occluding edges; null: without edges.
  PoseView(const TargetModel& model, const TargetScene* scene, const BeamModel& beam,
           const PlannerOptions& options, const Pose& pose);
  /// The target in a nearby pose, with the same edges.
  PoseView moved_to(const Pose& pose) const;

  /// Of beams of these directions (unit, sensor axes); faster where neighbours in the list are
  /// neighbours in space. returns: as many as directions.
  void returns(std::span<const Vector3d> directions, std::span<BeamReturn> returns) const;

  const std::vector<EdgePiece>& edges() const { return edges_; }
  /// Calls each(index) for every edge piece in a window.
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
  /// m^2 covered by a window of this size (rad) at the target.
  double area(double width, double height) const {
    return std::max(1e-12, range_ * range_ * width * height);
  }
  double area(const Window& window) const { return area(window.width, window.height); }

  /// Covariance of the pose as berth::perturbed (m, rad, sensor axes) from that of the parameters.
  Matrix6d pose_covariance(const Matrix6d& scaled) const;

 private:
  void sample_edges(const TargetScene& scene);
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

/// Fisher information of the windows' beams, surface errors marginalised patch by patch. returns:
/// set to the number of beams that return.
Matrix6d scan_information(const PoseView& view, const std::vector<Window>& windows,
                          int* returns = nullptr);

}  // namespace berth::estimator
