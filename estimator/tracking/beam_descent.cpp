// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_descent.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "estimator/tracking/edge_rest.h"

namespace berth::estimator {

namespace {

Matrix6d information_of(const Matrix6d& covariance) {
  return (covariance + 1e-12 * Matrix6d::Identity()).ldlt().solve(Matrix6d::Identity());
}

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
                          static_cast<std::size_t>(options.checked_misses))),
      outline_(scan) {
  pose_only_.of_velocity = false;
  at_.utime = scan.utime_mean;
  prior_.about.pose = predicted.pose;
  if (deskew) prior_.about.velocity = predicted.velocity;
  velocity_uncertain_ = deskew && !predicted.velocity_covariance.isZero(0);
  // Three times as wide as the prediction: what no return holds stays there.
  prior_.information.topLeftCorner<6, 6>() = information_of(9 * predicted.covariance);
  if (velocity_uncertain_) {
    prior_.information.bottomRightCorner<6, 6>() = information_of(predicted.velocity_covariance);
  }
  blurred_ = angles_blur_edges(beam_model, (predicted.pose * model.centre).norm());
  // When a beam was sent tells better than its angles where it went: it would be taken for motion.
  prior_.of_velocity = velocity_uncertain_ && !blurred_;
  among_edges_ = !wide() && options.edge_rest.most_beams > 0;
}

void BeamDescent::start_from(const Motion& motion) { static_cast<Motion&>(at_) = motion; }

void BeamDescent::run(const Pose& start) {
  start_from(prior_.at(start));
  settle();
  if (known_ && agree(at_.pose, best_.motion.pose, covariance_)) return;
  // Edges will tell more than a better step on faces; not which of two poses is the likelier.
  if (among_edges_ && !known_ && !blurred_) {
    take(known_by_faces());
  } else {
    close_in();
    take(polish());
  }
}

void BeamDescent::refine(const Pose& start) {
  start_from(prior_.at(start));
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
  take_if_likelier(found_at(prior_.at(predicted_.pose)));
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
        start, faces_at(prior_.at(start), beams_.few).information[0], model_.radius,
        [&](const Pose& pose) { return faces_at(prior_.at(pose), outlined().few).cost; },
        options_.open_directions);
    found = take_if_likelier(found_at(prior_.at(moved))) || found;
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

/// As the last step left it.
BeamDescent::Result BeamDescent::settled_at() const {
  return {at_, covariance_, information_, sums_, 0};
}

/// What was drawn to the nearest surface on the way here is no knowledge. Near edges a face may
/// have been mistaken for another; but where nothing else tells, that is better than nothing.
BeamDescent::Result BeamDescent::known_by_faces() const {
  constexpr double of_others = 0.1;
  Result result = settled_at();
  std::vector<MetFace> near;
  const BeamInformation certain = certain_faces(beams_.few, near);
  const BeamInformation others =
      beam_information(model_, beam_model_, scan_.beams, at_, on_faces(), near);
  result.information = certain.motion().information + of_others * others.motion().information;
  return result;
}

/// From the best: returns and outline, with edges ever less blurred.
void BeamDescent::rest_on_edges(std::initializer_list<double> scales_m, double last_m) {
  start_from(prior_.at(best_.motion.pose));
  sharpen(scales_m);
  BeamInformationOptions how = pose_only_;
  how.of_velocity = prior_.of_velocity;
  for (int i = 0; i < options_.polish_steps; ++i) {
    at_.covariance = blur(last_m);
    if (step(how, outlined().all) < 0.1) break;
  }
  // Edges this blurred do not count single beams.
  constexpr double flips = 3;
  take_if_likelier(found_at(at_), flips * pose_only_.gate_sigmas * pose_only_.gate_sigmas);
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
  const Vector12d away = difference(result.motion, prior_.about);
  double cost = result.sums.cost + away.dot(prior_.information * away);
  const BeamInformation missed = faces_at(result.motion, beams_.empty.picks);
  add_counts(missed, beams_.empty.weight, result.sums);
  return cost + beams_.empty.weight * missed.cost;
}

/// What beams say of a pose without edges, and without what was known before.
BeamInformation BeamDescent::faces_at(const Motion& motion, const BeamPicks& picks) const {
  BeamInformationOptions how = pose_only_;
  how.edges = false;
  BeamLinearisation at = at_;
  static_cast<Motion&>(at) = motion;
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
  constexpr double little = 20;  // in its own standard deviations, squared: the next is far less
  double last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < options_.settle_steps; ++i) {
    const double moved = step(how, beams_.few);
    const bool goes_round = i > 1 && moved > last;  // beams come to other faces and back
    if (moved < little || goes_round) break;
    // The gate closes gradually: the first steps know less than they think.
    at_.covariance = covariance_ + options_.gate_shrink * at_.covariance;
    last = moved;
  }
  at_.covariance = covariance_;
}

/// On ever more returns: the fit of each time is a good start for the next.
void BeamDescent::close_in() {
  constexpr std::size_t times = 10;
  for (std::size_t some = times * beams_.few.size(); 2 * some < beams_.all.size(); some *= times) {
    at_.covariance = covariance_;
    step_on_faces(evenly(beams_.all, some));
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
  Result last;
  double last_cost = std::numeric_limits<double>::infinity();
  for (int i = 0; i < options_.polish_steps; ++i) {
    at_.covariance = (i == 0 ? 1 : looseness) * covariance_;
    const Motion before = at_;
    const double length2 = step_on_faces(beams_.all);
    if (sums_.cost > last_cost + tolerance) {
      last.motion = before;
      break;
    }
    last = settled_at();
    last_cost = sums_.cost;
    const double moved = moved_since(before.pose);
    if (moved < small_m || (moved < most_small_m && length2 < small)) break;
  }
  return last;
}

void BeamDescent::rest() {
  by_faces_ = best_;
  if (among_edges_) {
    start_from(best_.motion);
    BeamInformationOptions how = pose_only_;
    how.of_velocity = velocity_uncertain_;
    EdgeRestOptions edges = options_.edge_rest;
    if (blurred_) edges = {0, std::numeric_limits<int>::max()};
    const EdgeRest rest = rest_among_edges(model_, beam_model_, scan_.beams, beams_.all, outline_,
                                           at_, best_.information, prior_, how, edges);
    best_ = {rest.motion, rest.covariance.topLeftCorner<6, 6>(), rest.information, rest.faces, 0};
    steps_ += rest.steps;
  }
  if (velocity_uncertain_ && !prior_.of_velocity) consider_velocity();
  count();
}

/// As a velocity that is not estimated is wrong, so is the pose (Schmidt 1966).
void BeamDescent::consider_velocity() {
  const Matrix6d information =
      best_.information.topLeftCorner<6, 6>() + prior_.information.topLeftCorner<6, 6>();
  const Matrix6d with_velocity =
      information.ldlt().solve(Matrix6d(best_.information.topRightCorner<6, 6>()));
  best_.covariance += with_velocity * predicted_.velocity_covariance * with_velocity.transpose();
}

/// What some beams say of the end. Those near edges, as well as these are known now, say nothing.
void BeamDescent::count() {
  constexpr std::size_t most_returns = 500;
  start_from(best_.motion);
  at_.covariance = best_.covariance;
  const auto add = [&](const BeamSample& some) {
    std::vector<MetFace> near;
    add_counts(wide() ? faces_at(best_.motion, some.picks) : certain_faces(some.picks, near),
               some.weight, best_.sums);
  };
  // What contradicted where the last steps began may fit the end.
  constexpr double beyond_doubt = 0.005;
  if (!among_edges_ || best_.sums.contradicted() > beyond_doubt) {
    best_.sums = {};
    add(sample(beams_.all, most_returns));
  }
  add(beams_.empty);
  best_.steps = steps_;
}

/// At the linearisation, of beams that meet the same face wherever it may be; near: the others.
BeamInformation BeamDescent::certain_faces(const BeamPicks& picks,
                                           std::vector<MetFace>& near) const {
  return beam_information(model_, beam_model_, scan_.beams, at_, on_faces(), picks, near);
}

BeamInformationOptions BeamDescent::on_faces() const {
  BeamInformationOptions how = pose_only_;
  how.edges = false;
  how.of_velocity = prior_.of_velocity;
  return how;
}

const BeamDescent::Outlined& BeamDescent::outlined() {
  constexpr std::size_t few = 500;
  if (!outlined_) {
    outlined_.emplace();
    const BeamPicks outline = outline_.all();
    std::merge(beams_.all.begin(), beams_.all.end(), outline.begin(), outline.end(),
               std::back_inserter(outlined_->all));
    outlined_->few = evenly(outlined_->all, few);
  }
  return *outlined_;
}

/// At the target's ends, m.
double BeamDescent::moved_since(const Pose& before) const {
  return distance(before, at_.pose) + model_.radius * angle_between(before, at_.pose);
}

/// On faces: all returns, or where edges come later, those that meet one face anyhow.
double BeamDescent::step_on_faces(const BeamPicks& picks) {
  if (among_edges_) {
    std::vector<MetFace> near;
    return take_step(certain_faces(picks, near), prior_.of_velocity);
  }
  BeamInformationOptions how = on_faces();
  how.misses = false;
  return step(how, picks);
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
  const Vector12d away = difference(at_, prior_.about);
  const Vector12d pulled = prior_.information * away;
  sums_.cost += away.dot(pulled);
  const Matrix12d information = information_ + prior_.information;
  Matrix12d covariance = Matrix12d::Zero();
  const Vector12d d = newton_step(information, said.gradient + pulled, of_velocity, covariance);
  covariance_ = covariance.topLeftCorner<6, 6>();
  start_from(perturbed(at_, d));
  ++steps_;
  return d.dot(information * d);
}

/// Where pose and velocity are the likeliest, the returns pull away from what was predicted as much
/// as that pulls back.
std::optional<MeasuredMotion> BeamDescent::measured() const {
  if (!prior_.of_velocity) return {};
  MeasuredMotion measured{best_.motion, {}};
  measured.said.information = best_.information;
  measured.said.gradient = -prior_.pull(best_.motion);
  measured.said.returns = best_.sums.used;
  return measured;
}

}  // namespace berth::estimator
