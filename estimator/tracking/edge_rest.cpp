// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_rest.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "estimator/tracking/edge_propagation.h"
#include "estimator/tracking/foreground.h"
#include "estimator/tracking/tracking.h"

namespace berth::estimator {

namespace {

/// Half the mean logarithm of the eigenvalues: of a standard deviation, with the other sign.
double mean_log_deviation(const Matrix12d& information, bool of_velocity) {
  const Eigen::Index size = of_velocity ? 12 : 6;
  const MotionMatrix known = information.topLeftCorner(size, size);
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

/// How far this step moved the target across a beam, where that returned from, rad.
Vector3d moved_across(const Beam& beam, const BeamLinearisation& at, const Vector12d& step) {
  const double time = static_cast<double>(beam.utime - at.utime) * 1e-6;
  const Vector6d then = step.head<6>() + time * step.tail<6>();
  const Vector3d arm = beam.range * beam.direction - at.pose.position;
  const Vector3d way = then.head<3>() + then.tail<3>().cross(arm);
  return (way - way.dot(beam.direction) * beam.direction) / beam.range;
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

  /// Those that meet one face wherever the target may be, once and for all: that is asked where a
  /// few of them, spread evenly, lead.
  void sum_up(const BeamPicks& returns) {
    constexpr std::size_t many = 12000;
    constexpr std::size_t least = 1000;
    constexpr std::size_t times = 16;
    // Fewer do not tell so well that it matters if some are of another face.
    constexpr std::size_t least_to_tell = 2000;
    BeamLinearisation about = descent_.at();
    if (returns.size() >= many) {
      sum_up(evenly(returns, std::max(least, returns.size() / times)), about);
      about = descent_.at();
      about.covariance *= looseness;
    }
    if (returns.size() >= least_to_tell && !model_.standing.none()) {
      foreground_.emplace(model_, about.pose.inverse().position);
    }
    sum_up(returns, about);
  }

  /// Whether the target is where other beams may be near edges than were thought to be.
  bool beyond() const {
    return !agree(descent_.at().pose, summed_about_.pose, summed_about_.covariance);
  }

  /// To where those that were doubtful, and those that passed close by, put it, too.
  void among_edges(const Outline& outline) {
    std::vector<MetFace> near;
    faces_ = counts_;
    const BeamInformation asked_again = ask_again(near);
    faces_ += asked_again;
    MotionInformation faces = sum(certain_, asked_again.motion());
    go(descent_.step(faces), faces);

    EdgePropagation edges(model_, beam_model_, beams_, near, outline, faces_.used, how_);
    const auto come_to = [&](const MotionInformation& said) {
      all_ = sum(faces, said);
      const Vector12d d = descent_.step(all_);
      go(d, faces);
      edges.moved(d);
    };
    constexpr std::size_t least = 64;  // fewer may all have passed by, and tell of no other
    const auto most = static_cast<std::size_t>(options_.most_beams);
    while (edges.waiting() && 2 * edges.taken() <= most) {
      const MotionInformation said = edges.take(descent_.at(), descent_.covariance());
      come_to(said);
      if (edges.waiting() && near.size() > least && edges.taken() >= least &&
          little_left(faces, said, edges.all_over_taken())) {
        break;
      }
    }
    // Each of the others met the face that it meets now, or another: most of what it would tell.
    MotionInformation others = what_others_say(edges.returns_left()).motion();
    constexpr double share = 0.75;
    others.information *= share;
    others.gradient *= share;
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
  const Foreground* foreground() const { return foreground_ ? &*foreground_ : nullptr; }

  /// The doubtful ones, as all know it now: most without a cast. near: those that are so still.
  BeamInformation ask_again(std::vector<MetFace>& near) const {
    // Where the target has moved by less than makes a beam doubtful, what meets another face now is
    // doubtful still.
    const double angle = std::hypot(beam_model_.azimuth_sigma_rad, beam_model_.elevation_sigma_rad);
    const double least_reach = how_.edge_sigmas * angle / std::sqrt(2.0);
    const Vector12d step = difference(summed_about_, descent_.at());
    std::vector<MetFace> again = doubtful_;
    for (MetFace& met : again) {
      const Vector3d moved = moved_across(beams_[met.beam], summed_about_, step);
      if (moved.squaredNorm() > least_reach * least_reach) met.triangle = MetFace::unknown;
    }
    return beam_information(model_, beam_model_, beams_, descent_.at(), of_faces_, again, near,
                            foreground());
  }

  /// As faces alone. Only the foreground tells what stands before one.
  BeamInformation what_others_say(std::vector<MetFace> others) const {
    if (foreground_) {
      return beam_information(model_, beam_model_, beams_, descent_.at(), of_faces_, others,
                              *foreground_);
    }
    for (MetFace& met : others) met.triangle = MetFace::unknown;
    return beam_information(model_, beam_model_, beams_, descent_.at(), of_faces_, others);
  }

  /// Of the target's ends, m.
  double way_from(const Pose& start) const {
    const Pose& now = descent_.at().pose;
    return distance(start, now) + model_.radius * angle_between(start, now);
  }

  void sum_up(const BeamPicks& returns, BeamLinearisation about) {
    constexpr int most_steps = 4;
    BeamInformationOptions how = of_faces_;
    how.doubtful = false;  // will be asked again
    for (int i = 0; i < most_steps; ++i) {
      counts_ = beam_information(model_, beam_model_, beams_, about, how, returns, doubtful_,
                                 foreground());
      certain_ = counts_.motion();
      summed_about_ = about;
      move(certain_, descent_.step(certain_));
      if (straight(about.pose)) break;
      static_cast<Motion&>(about) = descent_.at();
    }
  }

  /// Whether a way is so short that its bend, which is left out, is less than what is known.
  bool straight(const Pose& from) const {
    constexpr double little = 0.2;  // of a standard deviation
    const double way = way_from(from);
    return way * way / (2 * model_.radius) <
           little * uncertainty_of_ends(model_, descent_.at().covariance);
  }

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
  std::optional<Foreground> foreground_;  ///< about there
  BeamLinearisation summed_about_;
  MotionInformation certain_;      ///< of beams that meet one face
  std::vector<MetFace> doubtful_;  ///< the other returns
  BeamInformation counts_;         ///< of the certain ones
  BeamInformation faces_;          ///< and those of the others that were certain when asked again
  MotionInformation all_;
};

}  // namespace

EdgeRest rest_among_edges(const TargetModel& model, const BeamModel& beam_model,
                          std::span<const Beam> beams, const BeamPicks& returns,
                          const Outline& outline, const BeamLinearisation& start,
                          const Matrix12d& known, const MotionPrior& prior,
                          BeamInformationOptions how, EdgeRestOptions options) {
  constexpr int most_rounds = 6;
  constexpr double far2 = 4;  // variances
  // Each return of a few turns the target by itself: none is left to chance, and none left out.
  constexpr std::size_t few = 300;
  if (returns.size() <= few) {
    how.edge_sigmas = 4;
    options.least_gain = 0;
  }
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
