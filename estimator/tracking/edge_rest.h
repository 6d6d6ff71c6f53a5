// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/beam_selection.h"
#include "estimator/tracking/motion_prior.h"
#include "estimator/tracking/outline.h"

namespace berth::estimator {

struct EdgeRestOptions {
  /// Beams near edges are looked at until the others would make what is known better by less than
  /// this share, of a standard deviation. 0: all are.
  double least_gain = 0.7;
  int most_beams = 20000;  ///< near edges are looked at; 0: faces alone decide
};

/// Where returns, what they meet and what passes its edges put a motion together.
struct EdgeRest {
  Motion motion;
  Matrix12d covariance = Matrix12d::Zero();
  Matrix12d information = Matrix12d::Zero();  ///< of the beams alone
  BeamInformation faces;                      ///< counts, at the start
  int steps = 0;
};

/// Beams that meet one face wherever the target may be are summed up once, as a small step does not
/// change that. Then, in rounds until the motion stays: those that were doubtful, as all these know
/// it; the others, and those that passed close by, are weighed by expectation propagation.
/// start: at at.utime; known: what led there, information on it without the prior. Sensor frame, SI
/// units. The same bits every time.
EdgeRest rest_among_edges(const TargetModel& model, const BeamModel& beam_model,
                          std::span<const Beam> beams, const BeamPicks& returns,
                          const Outline& outline, const BeamLinearisation& start,
                          const Matrix12d& known, const MotionPrior& prior,
                          BeamInformationOptions how, EdgeRestOptions options);

}  // namespace berth::estimator
