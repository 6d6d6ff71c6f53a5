// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/meshes/symmetry.h"
#include "estimator/model/target_model.h"

namespace berth::trials {

/// A rigid motion of the model, in its own frame, that lays it on itself more or less.
struct SelfMatch {
  Pose motion;
  double residual = 0;  ///< largest distance of a visible point from the surface, m
};

/// All motions that are locally best, the identity left out; best first, at most `max_matches`.
/// Computed independently of the estimator's own symmetries.
std::vector<SelfMatch> self_matches(const estimator::TargetModel& model, std::size_t max_matches);

/// The judge of poses: right means within 5 degrees and 5 % of the length of the truth or of a pose
/// that shows the same surface (find_symmetry).
class PoseJudge {
 public:
  explicit PoseJudge(const estimator::TargetModel& model);

  bool right(const Pose& truth, const Pose& pose) const;
  /// Poses that look like the truth, more or less, but are not right.
  std::vector<Pose> rivals(const Pose& truth) const;
  /// Of the poses that show the same surface as the truth, the one nearest in attitude.
  Pose nearest_equal(const Pose& truth, const Pose& pose) const {
    return symmetry_.nearest_equal(truth, pose);
  }
  std::size_t symmetries() const { return 1 + symmetry_.motions.size(); }

 private:
  Vector3d centre_;
  double tolerance_m_;
  SymmetryGroup symmetry_;
  std::vector<Pose> near_;
};

}  // namespace berth::trials
