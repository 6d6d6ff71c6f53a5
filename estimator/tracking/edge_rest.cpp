// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_rest.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "estimator/tracking/edge_propagation.h"

namespace berth::estimator {

namespace {

/// Half the mean logarithm of the eigenvalues: of a standard deviation, with the other sign.
double mean_log_deviation(const Matrix12d& information, bool of_velocity) {
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 12, 12>;  // no heap
  const Eigen::Index size = of_velocity ? 12 : 6;
  const Square known = information.topLeftCorner(size, size);
  return -known.ldlt().vectorD().array().log().mean() / 2;
}

/// The motion on its way.
class Descent {
 public:
  Descent(const BeamLinearisation& start, const Matrix12d& known, const MotionPrior& prior)
      : at_(start), prior_(prior), start_(start) {
    held_ = (known + prior.information) / looseness;
    newton_step(held_, Vector12d::Zero(), prior.of_velocity, covariance_);
    at_.covariance = covariance_.topLeftCorner<6, 6>();
  }

  const BeamLinearisation& at() const { return at_; }
  const Matrix12d& covariance() const { return covariance_; }
  /// Until all beams have been looked at, the start counts, too.
  void let_go() { held_.setZero(); }

  /// @return the step that what the beams said asks for; they are linearised there now.
  Vector12d step(MotionInformation& said) {
    const Matrix12d information = said.information + prior_.information + held_;
    const Vector12d pulled = prior_.pull(at_) + held_ * difference(at_, start_);
    const Vector12d d =
        newton_step(information, said.gradient + pulled, prior_.of_velocity, covariance_);
    static_cast<Motion&>(at_) = perturbed(at_, d);
    at_.covariance = covariance_.topLeftCorner<6, 6>();
    said.gradient -= said.information * d;
    ++steps;
    return d;
  }

  int steps = 0;

 private:
  BeamLinearisation at_;
  const MotionPrior& prior_;
  Motion start_;
  Matrix12d held_;
  Matrix12d covariance_ = Matrix12d::Zero();
};

MotionInformation sum(const MotionInformation& a, const MotionInformation& b) {
  return {a.information + b.information, a.gradient + b.gradient, a.returns + b.returns};
}

}  // namespace

EdgeRest rest_among_edges(const TargetModel& model, const BeamModel& beam_model,
                          std::span<const Beam> beams, const BeamPicks& returns,
                          const BeamPicks& outline, const BeamLinearisation& start,
                          const Matrix12d& known, const MotionPrior& prior,
                          const BeamInformationOptions& how, const EdgeRestOptions& options) {
  Descent descent(start, known, prior);
  BeamInformationOptions of_faces = how;
  of_faces.edges = false;
  of_faces.misses = false;

  EdgeRest rest;
  MotionInformation faces;
  BeamPicks near = returns;
  for (int pass = 0; pass < 2; ++pass) {
    BeamPicks doubtful;
    const BeamInformation more =
        beam_information(model, beam_model, beams, descent.at(), of_faces, near, doubtful);
    rest.faces.doubtful = 0;  // was asked again
    rest.faces += more;
    faces = sum(faces, more.motion());
    descent.step(faces);
    near = std::move(doubtful);
  }

  near.insert(near.end(), outline.begin(), outline.end());
  EdgePropagation edges(model, beam_model, beams, near, how);
  MotionInformation all = faces;
  const auto move = [&](const MotionInformation& said) {
    all = sum(faces, said);
    const Vector12d d = descent.step(all);
    faces.gradient -= faces.information * d;
    edges.moved(d);
  };
  const auto little_left = [&](const MotionInformation& said) {
    const Matrix12d base = faces.information + prior.information;
    const double more = static_cast<double>(near.size()) / static_cast<double>(edges.taken());
    return mean_log_deviation(base + said.information, prior.of_velocity) -
               mean_log_deviation(base + more * said.information, prior.of_velocity) <
           std::log1p(options.least_gain);
  };
  constexpr std::size_t least_beams = 64;  // fewer may all have passed by, and tell of no other
  const auto most = static_cast<std::size_t>(options.most_beams);
  while (edges.waiting() && edges.taken() + edges.next() <= most) {
    const MotionInformation said = edges.take(descent.at(), descent.covariance());
    move(said);
    if (edges.waiting() && edges.taken() >= least_beams && little_left(said)) break;
  }
  // Each of the others met the face that it meets now, or another: half of what it would tell.
  MotionInformation others =
      beam_information(model, beam_model, beams, descent.at(), of_faces, edges.left()).motion();
  others.information *= 0.5;
  others.gradient *= 0.5;
  faces = sum(faces, others);
  descent.let_go();
  move(edges.sweep(descent.at(), descent.covariance()));

  rest.motion = descent.at();
  rest.covariance = descent.covariance();
  rest.information = all.information;
  rest.steps = descent.steps;
  return rest;
}

}  // namespace berth::estimator
