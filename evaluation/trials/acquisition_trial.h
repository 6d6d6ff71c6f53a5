// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "estimator/acquire/acquisition.h"
#include "estimator/model/target_model.h"
#include "evaluation/trials/self_match.h"
#include "evaluation/trials/world.h"

namespace berth::trials {

/// One scan of a target, to be acquired without any prior.
struct AcquisitionScene {
  Pose truth;  ///< T_sensor_model
  World world;
  Scan scan;
};

/// Requirements of a scene.
struct SceneWishes {
  Physics physics;
  int returns = 3000;                              ///< from the target, about
  Vector3d middle{0, 0, 5};                        ///< of the target, sensor frame, m
  Quaterniond attitude = Quaterniond::Identity();  ///< model to sensor frame
  bool plate = false;  ///< something else in the window, on which about a fifth of the returns fall
  int probe_beams = 2000;  ///< that are cast to find out how many a scan needs
};

/// A raster over the smallest window that holds the target and a twentieth more. The model must
/// outlive the scene.
AcquisitionScene make_scene(const std::shared_ptr<const estimator::TargetModel>& model,
                            const SceneWishes& wishes, Random& random);

/// Classes of acquisition results: an undecided one is acceptable, a silently wrong one is not.
enum class Verdict { right, ambiguous_with_truth, ambiguous_without, silently_wrong, lost };
/// "right", "ambiguous with truth" ...
const char* name_of(Verdict verdict);
/// Whether the truth is among the poses found.
inline bool has_truth(Verdict verdict) {
  return verdict == Verdict::right || verdict == Verdict::ambiguous_with_truth;
}

/// right: whether a pose is the true one. poses: best first.
Verdict verdict_on(estimator::AcquisitionResult::Status status, const std::vector<Pose>& poses,
                   const std::function<bool(const Pose&)>& right);
Verdict verdict_on(const estimator::AcquisitionResult& result, const PoseJudge& judge,
                   const Pose& truth);

}  // namespace berth::trials
