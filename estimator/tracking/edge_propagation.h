// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/edge_moments.h"
#include "estimator/tracking/edge_view.h"
#include "estimator/tracking/moving_frame.h"
#include "estimator/tracking/outline.h"

namespace berth::estimator {

/// What beams near the ends of faces say of the motion: each may have met one face, another, or
/// passed, as the pose and its own angle noise decide. Expectation propagation (Minka 2001): what a
/// beam says is replaced by a normal distribution (a site) such that, together with what all others
/// say (its cavity), the displacement of the target at that beam gets the mean and covariance that
/// it has by the beam's likelihood. So edges are as blurred as the pose is uncertain, and hits and
/// misses on both sides of one tell where it is. Beams are first looked at a group at a time: what
/// many say of one place, seen by all from what was known before any of them, is said too often.
class EdgePropagation {
 public:
  /// returns: whose place among the faces is not certain; outline: beams that did not return, but
  /// may have come close; certain_returns: how many others are of one face. What is passed in must
  /// outlive it.
  EdgePropagation(const TargetModel& model, const BeamModel& beam_model,
                  std::span<const Beam> beams, const std::vector<MetFace>& returns,
                  const Outline& outline, int certain_returns,
                  const BeamInformationOptions& options);

  /// Whether some beams have not been looked at.
  bool waiting() const { return waiting_ > 0; }
  /// How many have, and all over those that have.
  std::size_t taken() const { return taken_; }
  double all_over_taken() const { return std::ldexp(1.0, waiting_); }
  /// The returns that have not, in their order.
  std::vector<MetFace> returns_left() const;
  /// Twice as many as have been, from all over the scan. covariance: of the motion at the
  /// linearisation as it is known from all beams, those of the sites before included; as
  /// MotionInformation's d. @return the sum of the sites.
  MotionInformation take(const BeamLinearisation& at, const Matrix12d& covariance);
  /// Every site anew. As take().
  MotionInformation sweep(const BeamLinearisation& at, const Matrix12d& covariance);
  /// The linearisation moves by so much, and the sites stay where they are.
  void moved(const Vector12d& step);

 private:
  using Lever = Eigen::Matrix<double, 3, 6>;  // of a pose, sensor frame

  /// Of the target's displacement at the beam: [right; up; along the beam], m.
  struct Site {
    std::uint32_t beam = 0;
    double range = 0;  // of the edge; 0: not yet known
    double time = 0;   // s, after the reference
    Lever lever = Lever::Zero();
    Matrix3d precision = Matrix3d::Zero();
    Vector3d shift = Vector3d::Zero();  // precision times mean
    bool meets = false;                 // the target, wherever it may be
    bool final = false;                 // one face of it
  };

  double drop_out() const;
  bool blurred(const BeamLinearisation& at) const;
  double reach_of(const BeamLinearisation& at, const Matrix12d& covariance) const;
  void add(const Site& site, MotionInformation& sum) const;
  MotionInformation sum(const Matrix12d& covariance) const;
  bool renew(Site& site, const BeamLinearisation& at, MovingFrame& frame,
             const Matrix12d& covariance, std::size_t nodes);
  void look_along(const Beam& beam, const Matrix3d& axes, const MovingFrame& frame);
  bool cast(const Site& site, std::size_t nodes);
  EdgeMoments moments() const;
  void leave_out(const Site& site, const Matrix3d& here);
  bool rest_on_face(Site& site, const Matrix3d& here) const;
  void match(Site& site, const EdgeMoments& told) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  std::span<const Beam> beams_;
  const std::vector<MetFace>& returns_;
  const Outline& outline_;
  int certain_returns_;
  const BeamInformationOptions& options_;
  std::size_t nodes_;  // that draw a beam
  int groups_;
  int waiting_;  // groups; the next is the last
  std::size_t taken_ = 0;
  int meet_ = 0;               // of these, the target, wherever it may be
  int lost_ = 0;               // of those, without a return
  MotionInformation certain_;  // sum of the sites that do not change any more
  std::vector<Site> sites_;
  EdgeView view_;  // of the beam that is looked at
};

}  // namespace berth::estimator
