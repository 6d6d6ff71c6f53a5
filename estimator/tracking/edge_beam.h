// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>

#include "common/core/ray_caster.h"
#include "estimator/likelihood/beam_likelihood.h"
#include "estimator/tracking/beam_nodes.h"

namespace berth::estimator {

/// A beam at the end of a face: what there is to meet in the directions about its own, which it may
/// have had (angle noise), or which its light fills (footprint). Model frame.
struct EdgeBeam {
  std::array<Ray, BeamNodes::count> rays;
  std::array<RayHit, BeamNodes::count> hits;
  Vector3d right, up;      ///< from a direction to the next, see BeamNodes
  double footprint = 0;    ///< share of the nodes' variance that is the beam's width
  double pulse_m = 0;      ///< surfaces within it make one echo, at the mean range of their light
  double least_light = 1;  ///< share of a beam's light from which its first echo is seen

  /// Whether all directions meet one plane, to so many metres.
  bool one_plane(double tolerance) const;
  bool meets() const;
};

/// The first echo of a beam that is as wide as its nodes, as a row of a Gauss-Newton step.
struct MixedEcho {
  Vector3d normal = Vector3d::Zero();  ///< of [normal; torque]: change of minus the range
  Vector3d torque = Vector3d::Zero();  ///< with the model's motion
  double range = 0;                    ///< m, mean
  double spread = 0;  ///< m^2, variance: how much light which surface returns is not known
  double share = 0;   ///< of the beam's light
};
/// Nothing when the beam meets nothing.
std::optional<MixedEcho> mixed_echo(const EdgeBeam& beam, double least_cosine);

/// The score of a beam's likelihood (derivative of its logarithm with the pose), integrated over
/// its nodes. Moving the model along the beam moves the expected ranges; moving it across moves the
/// edge, which is the same as moving the beam the other way, and so is the integral weighed with
/// the score of the nodes' normal distribution.
struct EdgeScore {
  Vector3d force = Vector3d::Zero();
  Vector3d torque = Vector3d::Zero();
  double outwards = 0;  ///< so with how far outwards the front face's end lies, 1/m
  double on = 0;        ///< chance that what is seen is the target
  double regular = 0;   ///< chance that what was returned is of a surface of the target
  double chi2 = 0;      ///< of the return, if so
  double front = 0;     ///< range of the nearest surface, m
};
/// variance: of a range, m^2. The beam meets something.
EdgeScore edge_score(const EdgeBeam& edge, const Beam& beam, double variance,
                     const LikelihoodOptions& shares, double least_cosine);

}  // namespace berth::estimator
