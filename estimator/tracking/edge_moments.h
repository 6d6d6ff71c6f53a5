// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "estimator/likelihood/beam_likelihood.h"
#include "estimator/tracking/edge_view.h"

namespace berth::estimator {

/// Of the target's displacement at a beam, by its likelihood and what all others say: [right; up;
/// along it], m.
struct EdgeMoments {
  Vector3d mean = Vector3d::Zero();  ///< from the view's
  Matrix3d covariance = Matrix3d::Zero();
  double nodes = 0;  ///< about so many explain what was measured (Kish 1965)
};

/// Given where across the target the beam went (a node), the displacement is normal, and with the
/// node's face, the range is normal and linear in it; so it is a mixture of normal distributions.
EdgeMoments edge_moments(const EdgeView& view, const LikelihoodOptions& shares,
                         double least_cosine);

}  // namespace berth::estimator
