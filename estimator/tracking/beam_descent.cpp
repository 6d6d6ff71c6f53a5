// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_descent.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/tracking/edge_propagation.h"

namespace berth::estimator {

namespace {

Matrix6d information_of(const Matrix6d& covariance) {
  return (covariance + 1e-12 * Matrix6d::Identity()).ldlt().solve(Matrix6d::Identity());
}

Vector12d apart(const Motion& from, const Motion& to) {
  Vector12d apart;
  apart << difference(from.pose, to.pose), to.velocity.linear - from.velocity.linear,
      to.velocity.angular - from.velocity.angular;
  return apart;
}

/// What is known from where a descent comes to is taken for so much less, in variance: some faces
/// may have been mistaken.
constexpr double looseness = 8;

/// Of beams that each stand for so many.
void add_counts(const BeamInformation& counted, double weight, BeamInformation& sums) {
  const auto scaled = [weight](int count) { return static_cast<int>(std::lround(weight * count)); };
  sums.chi2 += weight * counted.chi2;
  sums.used += scaled(counted.used);
  sums.doubtful += scaled(counted.doubtful);
  sums.predicted += scaled(counted.predicted);
  sums.through += scaled(counted.through);
  sums.blocked += scaled(counted.blocked);
  sums.beside += scaled(counted.beside);
}

/// Whether two poses differ no more than one of this covariance does from the truth, on average.
bool agree(const Pose& a, const Pose& b, const Matrix6d& covariance) {
  constexpr double most = 6;  // one for each degree of freedom
  const Vector6d apart = difference(a, b);
  return apart.dot(covariance.ldlt().solve(apart)) < most;
}

}  // namespace

BeamDescent::BeamDescent(const TargetModel& model, const BeamModel& beam_model,
                         const CleanScan& scan, const Prediction& predicted,
                         const BeamDescentOptions& options, bool deskew)
    : model_(model),
      beam_model_(beam_model),
      scan_(scan),
      predicted_(predicted),
      options_(options),
      pose_only_(options.information),
      beams_(select_beams(scan, static_cast<std::size_t>(options.settle_returns),
                          static_cast<std::size_t>(options.checked_misses))) {
  pose_only_.of_velocity = false;
  at_.utime = scan.utime_mean;
  if (deskew) velocity_ = predicted.velocity;
  of_velocity_ = deskew && !predicted.velocity_covariance.isZero(0);
  // Three times as wide as the prediction: what no return holds stays there.
  prior_.topLeftCorner<6, 6>() = information_of(9 * predicted.covariance);
  if (of_velocity_) {
    prior_.bottomRightCorner<6, 6>() = information_of(predicted.velocity_covariance);
  }
  blurred_ = angles_blur_edges(beam_model, (predicted.pose * model.centre).norm());
  const bool many = beams_.all.size() > static_cast<std::size_t>(options_.most_edge_returns);
  among_edges_ = !wide() && (blurred_ || !many);
}

void BeamDescent::start_from(const Pose& pose) {
  at_.pose = pose;
  at_.velocity = velocity_;
}

void BeamDescent::run(const Pose& start) {
  start_from(start);
  settle();
  if (known_ && agree(at_.pose, best_.motion.pose, covariance_)) return;
  close_in();
  take(polish());
}

void BeamDescent::refine(const Pose& start) {
  start_from(start);
  covariance_ = predicted_.covariance;
  take(polish());
}

/// The first, or if it is likelier than what was known.
void BeamDescent::take(Result result) {
  if (known_) {
    best_cost_ = weigh(best_);
    take_if_likelier(std::move(result));
  } else {
    best_ = std::move(result);
    known_ = true;
  }
}

/// By edges, from the likelier of the best and the prediction; and unless that settles it, along
/// what faces leave open.
void BeamDescent::search(const Judgement& settled, const Judgement& credible) {
  if (by_faces_) best_ = *by_faces_;
  // Steps that faces led may have gone away from what was good.
  best_cost_ = weigh(best_);
  take_if_likelier(found_at({predicted_.pose, velocity_}));
  const double blur_m = std::max(options_.least_edge_blur_m, options_.edge_blur * beam_spacing());
  const Result by_faces = best_;
  rest_on_edges({1.5 * blur_m}, blur_m);
  if (settled(best_)) return;
  if (credible(best_) && agree(by_faces.motion.pose, best_.motion.pose, by_faces.covariance))
    return;
  rest_on_edges({8 * blur_m, 3 * blur_m, 1.5 * blur_m}, blur_m);
  if (settled(best_)) return;
  const Pose starts[] = {best_.motion.pose, predicted_.pose};
  bool found = false;
  for (const Pose& start : starts) {
    const Pose moved = along_open_directions(
        start, faces_at({start, velocity_}, beams_.few).information[0], model_.radius,
        [&](const Pose& pose) {
          return faces_at({pose, velocity_}, outlined().few).cost;
        },
        options_.open_directions);
    found = take_if_likelier(found_at({moved, velocity_})) || found;
  }
  if (found) rest_on_edges({3 * blur_m, 1.5 * blur_m}, blur_m);
}

/// As well known as the best.
BeamDescent::Result BeamDescent::found_at(const Motion& motion) const {
  Result result;
  result.motion = motion;
  result.covariance = best_.covariance;
  result.information = best_.information;
  return result;
}

/// From the best: returns and outline, with edges ever less blurred.
void BeamDescent::rest_on_edges(std::initializer_list<double> scales_m, double last_m) {
  start_from(best_.motion.pose);
  sharpen(scales_m);
  BeamInformationOptions how = pose_only_;
  how.of_velocity = of_velocity_;
  for (int i = 0; i < options_.polish_steps; ++i) {
    at_.covariance = blur(last_m);
    if (step(how, outlined().all) < 0.1) break;
  }
  // Edges this blurred do not count single beams.
  constexpr double flips = 3;
  take_if_likelier(found_at(now()), flips * pose_only_.gate_sigmas * pose_only_.gate_sigmas);
  best_.covariance = covariance_;
  best_.information = information_;
}

/// @return whether it is, or nearly.
bool BeamDescent::take_if_likelier(Result other, double tolerance) {
  const double cost = weigh(other);
  if (!(cost < best_cost_ + tolerance)) return false;
  best_cost_ = cost;
  best_ = std::move(other);
  return true;
}

/// Counts and cost of a pose as it is.
double BeamDescent::weigh(Result& result) const {
  result.sums = faces_at(result.motion, beams_.all);
  const Vector12d away = away_from(result.motion);
  double cost = result.sums.cost + away.dot(prior_ * away);
  const BeamInformation missed = faces_at(result.motion, beams_.empty.picks);
  add_counts(missed, beams_.empty.weight, result.sums);
  return cost + beams_.empty.weight * missed.cost;
}

/// What beams say of a pose without edges, and without what was known before.
BeamInformation BeamDescent::faces_at(const Motion& motion, const BeamPicks& picks) const {
  BeamInformationOptions how = pose_only_;
  how.edges = false;
  BeamLinearisation at = at_;
  at.pose = motion.pose;
  at.velocity = motion.velocity;
  at.covariance.setZero();
  return beam_information(model_, beam_model_, scan_.beams, at, how, picks);
}

/// From a return to the beam after it, m: the middle one.
double BeamDescent::beam_spacing() const {
  std::vector<double> squares;
  squares.reserve(beams_.few.size());
  for (const std::uint32_t i : beams_.few) {
    if (i + 1 >= scan_.beams.size()) continue;
    const Beam& beam = scan_.beams[i];
    squares.push_back((scan_.beams[i + 1].direction - beam.direction).squaredNorm() * beam.range *
                      beam.range);
  }
  if (squares.empty()) return 0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle);
}

/// Covariance that blurs edges by so much.
Matrix6d BeamDescent::blur(double scale_m) const {
  const double turn = scale_m / model_.radius;
  Vector6d variances;
  variances << Vector3d::Constant(scale_m * scale_m), Vector3d::Constant(turn * turn);
  return variances.asDiagonal();
}

/// Without edges; what does not fit is drawn to the nearest surface.
void BeamDescent::settle() {
  BeamInformationOptions how = pose_only_;
  how.edges = false;
  how.misses = false;
  how.pull_sigma_m = options_.pull_sigma_m;
  at_.covariance = predicted_.covariance;
  for (int i = 0; i < options_.settle_steps; ++i) {
    const double moved = step(how, beams_.few);
    // The gate closes gradually: the first steps know less than they think.
    at_.covariance = covariance_ + options_.gate_shrink * at_.covariance;
    if (moved < 1) break;
  }
}

/// So near that one step on all returns of a large scan is enough.
void BeamDescent::close_in() {
  if (beams_.all.size() < 2 * beams_.some.size()) return;
  BeamInformationOptions how = pose_only_;
  how.edges = false;
  for (int i = 0; i < 2; ++i) {
    at_.covariance = covariance_;
    step(how, beams_.some);
  }
}

void BeamDescent::sharpen(std::initializer_list<double> scales_m) {
  constexpr int most_steps = 2;  // at one scale
  for (const double scale : scales_m) {
    for (int i = 0; i < most_steps; ++i) {
      at_.covariance = blur(scale);
      if (step(pose_only_, outlined().few) < 1) break;
    }
  }
}

/// All returns, or all but those near edges. A step after which they are less likely is taken back.
BeamDescent::Result BeamDescent::polish() {
  constexpr double flips = 3;  // beams that come to another face make the cost jump by gates
  const double tolerance = flips * pose_only_.gate_sigmas * pose_only_.gate_sigmas;
  // A further step would change the pose by the square of this one, and few beams' faces.
  constexpr double small_m = 0.001;  // of the target's ends
  constexpr double most_small_m = 4 * small_m;
  constexpr double small = 100;  // in its own standard deviations, squared; then up to the latter
  BeamInformationOptions how = pose_only_;
  how.edges = false;
  how.misses = false;
  how.of_velocity = of_velocity_;
  Result last;
  double last_cost = std::numeric_limits<double>::infinity();
  for (int i = 0; i < options_.polish_steps; ++i) {
    at_.covariance = (i == 0 ? 1 : looseness) * covariance_;
    const Motion before = now();
    BeamPicks near;
    const double length2 = among_edges_ ? take_step(certain_faces(beams_.all, near), of_velocity_)
                                        : step(how, beams_.all);
    if (sums_.cost > last_cost + tolerance) {
      last.motion = before;
      break;
    }
    last = {now(), covariance_, information_, sums_, 0};
    last_cost = sums_.cost;
    const double moved = moved_since(before.pose);
    if (moved < small_m || (moved < most_small_m && length2 < small)) break;
  }
  return last;
}

void BeamDescent::rest() {
  constexpr double far = 100;  // in standard deviations, squared
  constexpr int most_rounds = 2;
  by_faces_ = best_;
  for (int i = 0; among_edges_ && i < most_rounds; ++i) {
    const Pose before = best_.motion.pose;
    rest_among_edges();
    const Vector6d d = difference(before, best_.motion.pose);
    if (d.dot(best_.covariance.ldlt().solve(d)) < far) break;
  }
  count();
}

/// Beams away from edges are summed up once: a small step does not change their faces.
void BeamDescent::rest_among_edges() {
  constexpr int most_sweeps = 2;
  constexpr double small = 1;  // step, in its own standard deviations, squared
  const Motion start = best_.motion;
  at_.pose = start.pose;
  at_.velocity = start.velocity;
  // Until all beams have been looked at, the start counts, too.
  Matrix12d held = (best_.information + prior_) / looseness;
  Matrix12d covariance = Matrix12d::Zero();
  solve(held, Vector12d::Zero(), of_velocity_, covariance);
  at_.covariance = covariance.topLeftCorner<6, 6>();

  BeamPicks near;
  MotionInformation faces = certain_faces(beams_.all, near).motion();
  near.insert(near.end(), outlined().outline.begin(), outlined().outline.end());
  BeamInformationOptions how = pose_only_;
  how.of_velocity = of_velocity_;
  EdgePropagation edges(model_, beam_model_, scan_.beams, near, how);
  MotionInformation said;
  const auto move = [&] {
    const Matrix12d information = faces.information + said.information + prior_ + held;
    const Vector12d pulled = prior_ * away_from(now()) + held * apart(now(), start);
    const Vector12d d =
        solve(information, faces.gradient + said.gradient + pulled, of_velocity_, covariance);
    go_on(d);
    faces.gradient -= faces.information * d;
    said.gradient -= said.information * d;
    edges.moved(d);
    return d.dot(information * d);
  };
  while (edges.waiting()) {
    said = edges.take(at_, covariance);
    move();
  }
  held.setZero();
  for (int i = 0; i < most_sweeps; ++i) {
    said = edges.sweep(at_, covariance);
    if (move() < small) break;
  }
  best_.motion = now();
  best_.covariance = covariance.topLeftCorner<6, 6>();
  best_.information = faces.information + said.information;
}

/// What some beams say of the end. Those near edges, as well as these are known now, say nothing.
void BeamDescent::count() {
  constexpr std::size_t most_returns = 500;
  at_.pose = best_.motion.pose;
  at_.velocity = best_.motion.velocity;
  at_.covariance = best_.covariance;
  best_.sums = {};
  for (const BeamSample& some : {sample(beams_.all, most_returns), beams_.empty}) {
    BeamPicks near;
    add_counts(wide() ? faces_at(best_.motion, some.picks) : certain_faces(some.picks, near),
               some.weight, best_.sums);
  }
  best_.steps = steps_;
}

/// At the linearisation, of beams that meet the same face wherever it may be; near: the others.
BeamInformation BeamDescent::certain_faces(const BeamPicks& picks, BeamPicks& near) const {
  BeamInformationOptions how = pose_only_;
  how.edges = false;
  how.of_velocity = of_velocity_;
  return beam_information(model_, beam_model_, scan_.beams, at_, how, picks, near);
}

/// Of the pose alone, or of the velocity, too. covariance: the information's inverse.
Vector12d BeamDescent::solve(const Matrix12d& information, const Vector12d& gradient,
                             bool of_velocity, Matrix12d& covariance) {
  using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 12, 12>;  // no heap
  const Eigen::Index size = of_velocity ? 12 : 6;
  const Square known = information.topLeftCorner(size, size);
  const Square inverse = known.ldlt().solve(Square::Identity(size, size));
  covariance.topLeftCorner(size, size) = 0.5 * (inverse + inverse.transpose());
  return covariance * gradient;
}

void BeamDescent::go_on(const Vector12d& step) {
  at_.pose = perturbed(at_.pose, step.head<6>());
  at_.velocity.linear += step.segment<3>(6);
  at_.velocity.angular += step.tail<3>();
  ++steps_;
}

const OutlineSelection& BeamDescent::outlined() {
  if (!outlined_) {
    outlined_ = select_outline(scan_, 2 * static_cast<std::size_t>(options_.settle_returns));
  }
  return *outlined_;
}

/// At the target's ends, m.
double BeamDescent::moved_since(const Pose& before) const {
  return distance(before, at_.pose) + model_.radius * angle_between(before, at_.pose);
}

/// To what is predicted of pose and velocity.
Vector12d BeamDescent::away_from(const Motion& motion) const {
  return apart(motion, {predicted_.pose, velocity_});
}

/// @return the step's length in its own standard deviations, squared.
double BeamDescent::step(const BeamInformationOptions& how, const BeamPicks& picks) {
  return take_step(beam_information(model_, beam_model_, scan_.beams, at_, how, picks),
                   how.of_velocity);
}

double BeamDescent::take_step(const BeamInformation& sums, bool of_velocity) {
  sums_ = sums;
  const MotionInformation said = sums_.motion();
  information_ = said.information;
  const Vector12d away = away_from(now());
  const Vector12d pulled = prior_ * away;
  sums_.cost += away.dot(pulled);
  const Matrix12d information = information_ + prior_;
  Matrix12d covariance = Matrix12d::Zero();
  const Vector12d d = solve(information, said.gradient + pulled, of_velocity, covariance);
  covariance_ = covariance.topLeftCorner<6, 6>();
  go_on(d);
  return d.dot(information * d);
}

/// Where pose and velocity are the likeliest, the returns pull away from what was predicted as much
/// as that pulls back.
std::optional<MeasuredMotion> BeamDescent::measured() const {
  if (!of_velocity_) return {};
  MeasuredMotion measured{best_.motion, {}};
  measured.said.information = best_.information;
  measured.said.gradient = -prior_ * away_from(best_.motion);
  measured.said.returns = best_.sums.used;
  return measured;
}

}  // namespace berth::estimator
