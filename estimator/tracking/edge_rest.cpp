// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_rest.h"

#include <Eigen/Cholesky>
#include <algorithm>
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
      : at_(start), prior_(prior) {
    stay_about(known);
  }

  const BeamLinearisation& at() const { return at_; }
  const Matrix12d& covariance() const { return covariance_; }

  /// Here, as well as this tells, until let go.
  void stay_about(const Matrix12d& known) {
    start_ = at_;
    held_ = (known + prior_.information) / looseness;
    newton_step(held_, Vector12d::Zero(), prior_.of_velocity, covariance_);
    at_.covariance = covariance_.topLeftCorner<6, 6>();
  }
  /// Until all beams have been looked at, the start counts, too.
  void let_go() { held_.setZero(); }

  /// @return the step that what the beams said asks for.
  Vector12d step(const MotionInformation& said) {
    const Matrix12d information = said.information + prior_.information + held_;
    const Vector12d pulled = prior_.pull(at_) + held_ * difference(at_, start_);
    const Vector12d d =
        newton_step(information, said.gradient + pulled, prior_.of_velocity, covariance_);
    static_cast<Motion&>(at_) = perturbed(at_, d);
    at_.covariance = covariance_.topLeftCorner<6, 6>();
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

/// Linearised where the motion went by this step.
void move(MotionInformation& said, const Vector12d& step) {
  said.gradient -= said.information * step;
}

/// A few that are spread evenly, then those between them, ...
std::vector<BeamPicks> in_stages(const BeamPicks& beams) {
  constexpr std::size_t times = 16;
  constexpr std::size_t least = 1000;
  std::size_t stride = 1;
  while (beams.size() / (times * stride) >= least) stride *= times;
  std::vector<BeamPicks> stages{{}};
  for (std::size_t i = 0; i < beams.size(); i += stride) stages.back().push_back(beams[i]);
  for (; stride > 1; stride /= times) {
    const std::size_t step = stride / times;
    BeamPicks& between = stages.emplace_back();
    between.reserve(beams.size() / step);
    for (std::size_t i = 0; i < beams.size(); i += stride) {
      const std::size_t end = std::min(i + stride, beams.size());
      for (std::size_t n = i + step; n < end; n += step) between.push_back(beams[n]);
    }
  }
  return stages;
}

class Rest {
 public:
  Rest(const TargetModel& model, const BeamModel& beam_model, std::span<const Beam> beams,
       const BeamLinearisation& start, const Matrix12d& known, const MotionPrior& prior,
       const BeamInformationOptions& how, const EdgeRestOptions& options)
      : model_(model),
        beam_model_(beam_model),
        beams_(beams),
        prior_(prior),
        how_(how),
        options_(options),
        of_faces_(how),
        descent_(start, known, prior) {
    of_faces_.edges = false;
    of_faces_.misses = false;
  }

  const Descent& descent() const { return descent_; }

  /// Those that meet one face wherever the target may be, once and for all.
  void sum_up(const BeamPicks& returns) {
    counts_ = {};
    certain_ = {};
    doubtful_.clear();
    BeamLinearisation loosely = descent_.at();
    for (const BeamPicks& stage : in_stages(returns)) {
      summed_about_ = loosely;
      BeamPicks asked(stage.size() + doubtful_.size());  // in order: rays side by side are cheaper
      std::merge(stage.begin(), stage.end(), doubtful_.begin(), doubtful_.end(), asked.begin());
      const BeamInformation said =
          beam_information(model_, beam_model_, beams_, loosely, of_faces_, asked, doubtful_);
      counts_.doubtful = 0;  // were asked again
      counts_ += said;
      certain_ = sum(certain_, said.motion());
      move(certain_, descent_.step(certain_));
      loosely = descent_.at();
      loosely.covariance *= looseness;
    }
    counts_.doubtful = 0;  // will be asked again
  }

  /// Whether the target is where other beams may be near edges than were thought to be.
  bool beyond() const {
    return !agree(descent_.at().pose, summed_about_.pose, summed_about_.covariance);
  }

  /// To where those that were doubtful, and those that passed close by, put it, too.
  void among_edges(const BeamPicks& outline) {
    BeamPicks near;
    faces_ = counts_;
    const BeamInformation asked_again =
        beam_information(model_, beam_model_, beams_, descent_.at(), of_faces_, doubtful_, near);
    faces_ += asked_again;
    MotionInformation faces = sum(certain_, asked_again.motion());
    go(descent_.step(faces), faces);

    EdgePropagation edges(model_, beam_model_, beams_, near, outline, how_);
    const auto come_to = [&](const MotionInformation& said) {
      all_ = sum(faces, said);
      const Vector12d d = descent_.step(all_);
      go(d, faces);
      edges.moved(d);
    };
    constexpr std::size_t least_beams = 64;  // fewer may all have passed by, and tell of no other
    const auto most = static_cast<std::size_t>(options_.most_beams);
    while (edges.waiting() && edges.taken() + edges.next() <= most) {
      const MotionInformation said = edges.take(descent_.at(), descent_.covariance());
      come_to(said);
      if (edges.waiting() && edges.taken() >= least_beams &&
          little_left(faces, said, edges.all_over_taken())) {
        break;
      }
    }
    // Each of the others met the face that it meets now, or another: half of what it would tell.
    MotionInformation others = beam_information(model_, beam_model_, beams_, descent_.at(),
                                                of_faces_, edges.returns_left())
                                   .motion();
    others.information *= 0.5;
    others.gradient *= 0.5;
    faces = sum(faces, others);
    descent_.let_go();
    come_to(edges.sweep(descent_.at(), descent_.covariance()));
  }

  /// What led here, for another round.
  void stay() { descent_.stay_about(all_.information); }

  EdgeRest result() const {
    return {descent_.at(), descent_.covariance(), all_.information, faces_, descent_.steps};
  }

 private:
  void go(const Vector12d& step, MotionInformation& faces) {
    move(certain_, step);
    move(faces, step);
  }

  /// Whether so many times what these beams said would make what is known better by too little.
  bool little_left(const MotionInformation& faces, const MotionInformation& said,
                   double times) const {
    const Matrix12d base = faces.information + prior_.information;
    return mean_log_deviation(base + said.information, prior_.of_velocity) -
               mean_log_deviation(base + times * said.information, prior_.of_velocity) <
           std::log1p(options_.least_gain);
  }

  const TargetModel& model_;
  const BeamModel& beam_model_;
  std::span<const Beam> beams_;
  const MotionPrior& prior_;
  const BeamInformationOptions& how_;
  const EdgeRestOptions& options_;
  BeamInformationOptions of_faces_;
  Descent descent_;
  BeamLinearisation summed_about_;  ///< in the last stage
  MotionInformation certain_;       ///< of beams that meet one face
  BeamPicks doubtful_;              ///< the other returns, in order
  BeamInformation counts_;          ///< of the certain ones
  BeamInformation faces_;           ///< and those of the others that were certain when asked again
  MotionInformation all_;
};

}  // namespace

EdgeRest rest_among_edges(const TargetModel& model, const BeamModel& beam_model,
                          std::span<const Beam> beams, const BeamPicks& returns,
                          const BeamPicks& outline, const BeamLinearisation& start,
                          const Matrix12d& known, const MotionPrior& prior,
                          const BeamInformationOptions& how, const EdgeRestOptions& options) {
  constexpr int most_rounds = 6;
  constexpr double far2 = 4;  // variances
  Rest rest(model, beam_model, beams, start, known, prior, how, options);
  for (int round = 0; round < most_rounds; ++round) {
    if (round == 0 || rest.beyond()) rest.sum_up(returns);
    const Pose before = rest.descent().at().pose;
    rest.among_edges(outline);
    // Farther off, edges and what they say of each other look otherwise.
    const BeamLinearisation& now = rest.descent().at();
    if (agree(before, now.pose, far2 * now.covariance)) break;
    rest.stay();
  }
  return rest.result();
}

}  // namespace berth::estimator
