// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/trials/acquisition_trial.h"

#include <algorithm>
#include <cmath>

namespace berth::trials {
namespace {

using estimator::AcquisitionResult;

/// A plate somewhere in the window, sensor frame, on which about a fifth of the returns fall.
Mesh plate_in(const Window& window, double fill, Random& random) {
  const double share = std::sqrt(0.25 * fill);
  const double range = random.uniform(3.8, 6.5);
  const double azimuth = window.azimuth + random.uniform(-0.5, 0.5) * window.width * (1 - share);
  const double elevation =
      window.elevation + random.uniform(-0.5, 0.5) * window.height * (1 - share);
  Mesh plate;
  plate.append(make_box({share * window.width * range, share * window.height * range, 0.05}),
               {range * beam_direction(azimuth, elevation), Quaterniond::Identity()});
  return plate;
}

}  // namespace

AcquisitionScene make_scene(const std::shared_ptr<const estimator::TargetModel>& model,
                            const SceneWishes& wishes, Random& random) {
  Pose truth{wishes.middle, wishes.attitude};
  // Its middle is there, wherever its origin is.
  truth.position += wishes.middle - truth * model->centre;
  // The true surface is the model's own, unless it departs from it.
  const auto world = [&](const Mesh& clutter) {
    return wishes.physics.mesh_sigma_m > 0
               ? World(model->target.mesh, wishes.physics, random, clutter)
               : World({model, &model->caster}, wishes.physics, clutter);
  };
  World empty = world({});
  std::vector<Window> windows = {window_around(model->target.mesh, truth, 0.05)};
  windows.front().count = wishes.probe_beams;
  const double fill = empty.expected_returns(windows, truth) / windows.front().count;
  windows = scaled_to_returns(empty, windows, truth, wishes.returns);
  World full = wishes.plate ? world(plate_in(windows.front(), fill, random)) : std::move(empty);
  Scan scan = full.sweep(windows, truth, random);
  return {truth, std::move(full), std::move(scan)};
}

const char* name_of(Verdict verdict) {
  constexpr const char* names[] = {"right", "ambiguous with truth", "ambiguous without truth",
                                   "silently wrong", "lost"};
  return names[static_cast<int>(verdict)];
}

Verdict verdict_on(AcquisitionResult::Status status, const std::vector<Pose>& poses,
                   const std::function<bool(const Pose&)>& right) {
  if (status == AcquisitionResult::Status::found) {
    return right(poses.front()) ? Verdict::right : Verdict::silently_wrong;
  }
  if (status != AcquisitionResult::Status::ambiguous) return Verdict::lost;
  const auto end = poses.begin() + std::min<std::ptrdiff_t>(4, std::ssize(poses));
  return std::any_of(poses.begin(), end, right) ? Verdict::ambiguous_with_truth
                                                : Verdict::ambiguous_without;
}

Verdict verdict_on(const AcquisitionResult& result, const PoseJudge& judge, const Pose& truth) {
  std::vector<Pose> poses;
  for (const auto& h : result.hypotheses) poses.push_back(h.pose);
  return verdict_on(result.status, poses,
                    [&](const Pose& pose) { return judge.right(truth, pose); });
}

}  // namespace berth::trials
