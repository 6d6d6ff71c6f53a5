// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/trials/self_match.h"
#include "evaluation/trials/world.h"

namespace berth::benchmark {

using namespace trials;

/// The log-likelihood of a scan given the exact world: every beam goes where it was
/// sent but for the angle noise, nothing else is there, nothing drops out. Written apart from the
/// estimator's.
class JudgeLikelihood {
 public:
  JudgeLikelihood(const RayCaster& caster, const BeamModel& noise)
      : caster_(caster), noise_(noise) {}

  /// Stops counting below `pruned`.
  double of(const std::vector<RawBeam>& beams, const Pose& pose, double pruned = -1e300) const;

  /// By how much the truth leads every other pose that was found: rivals, the method's own
  /// hypotheses, each climbed to its local best.
  double lead(const std::vector<RawBeam>& beams, const Pose& truth, const PoseJudge& judge,
              const std::vector<Pose>& hypotheses, Random random) const;

 private:
  double of_beam(const RawBeam& beam, const Pose& to_model) const;
  /// Gauss-Newton on the ranges.
  Pose polished(const std::vector<RawBeam>& beams, Pose pose) const;

  const RayCaster& caster_;
  BeamModel noise_;
};

}  // namespace berth::benchmark
