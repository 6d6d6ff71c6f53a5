// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/likelihood_tracking.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>

#include "common/core/covariance.h"
#include "common/core/text.h"

namespace berth::estimator {
namespace {

// Choices of cost: half or twice as much of each changes estimates by far less than their sigma.
/// Of the noise of a patch's returns, what the alikeness of the surface may leave out.
constexpr double share_of_noise = 0.2;
/// From one width of the likelihood to the next, about.
constexpr double annealing_ratio = 2;
/// Steps at each width, and at most at the last: views along a panel take many.
constexpr int first_iterations = 3;
constexpr int last_iterations = 10;
/// How often it is looked at what beams may meet, at most, without widening.
constexpr int max_looks = 4;
/// On the information of what a stage holds as it was known before: a hundredth of its sigma.
constexpr double held = 1e4;
/// Steps end where they would raise the log-likelihood by less than half of this; looks, where the
/// pose has moved by less: chi squared of six degrees of freedom. Where a step promised no more
/// than a small gain, and it did not come, no shorter one is tried.
constexpr double settled_gain = 0.1;
constexpr double settled_move = 1;
constexpr double small_gain = 2;
/// Where fewer of the beams that should meet the target fit than outliers usually leave, other
/// starts are tried; they cost time alone where the first was right.
constexpr double fit_as_usual = 1 - BeamShares{}.outlier;
/// Of the pose from the prediction. Farther off, the target has moved if beams fit as usual.
constexpr double max_from_prediction = one_in_a_million;

/// The optimisation of one scan.
class Fit {
 public:
  Fit(ScanFit& scan, const ScanStateLayout& layout, const ScanState& start,
      const ScanState& prior_state)
      : scan_(scan), layout_(layout), prior_state_(prior_state), state_(start) {}

  /// @param prior information about the prior state, in this stage and what is asked for after it
  void run(const ScanFit::Stage& stage, const std::vector<ScanFit::Surface>& surfaces,
           const Eigen::MatrixXd& prior, int iterations) {
    prior_ = prior;
    scan_.prepare(state_, stage, surfaces);
    at_ = scan_.linearise(state_,
                          Eigen::VectorXd::Zero(static_cast<Eigen::Index>(scan_.patches().size())));
    covariance_ = OffsetCovariance(scan_.patches(), at_.sums, scan_.scales, share_of_noise);
    offsets_squared_ = 0;
    double cost = cost_of(at_, state_, offsets_squared_);
    double damping = 0;
    for (int i = 0; i < iterations; ++i) {
      const MarginalisedEquations equations(at_.sums, covariance_, scan_.scales);
      const Eigen::VectorXd off = from_prior(state_);
      const Eigen::MatrixXd information = equations.information() + prior_;
      const Eigen::VectorXd gradient = equations.gradient() - prior_ * off;
      bool better = false;
      double gain = 0;
      for (int tries = 0; tries < 3 && !better; ++tries) {
        Eigen::MatrixXd damped = information;
        damped.diagonal() *= 1 + damping;
        const Eigen::VectorXd step = damped.ldlt().solve(gradient);
        gain = gradient.dot(step);
        const ScanState trial = layout_.moved(state_, step);
        ScanFit::Linearised there = scan_.linearise(trial, equations.offsets(step));
        const double offsets_squared = equations.offsets_squared(step);
        const double trial_cost = cost_of(there, trial, offsets_squared);
        ++evaluations_;
        if (trial_cost < cost + 0.01) {
          better = true;
          state_ = trial;
          at_ = std::move(there);
          cost = trial_cost;
          offsets_squared_ = offsets_squared;
          damping /= 10;
          if (damping < 1e-4) damping = 0;
        } else {
          damping = std::max(1e-2, 10 * damping);
          if (gain < small_gain) break;
        }
      }
      if (!better || gain < settled_gain) break;
    }
    scan_.shares = at_.shares;
  }

  /// The most probable scales of the fields' sigmas: evidence, by MacKay's fixed point.
  void learn_scales(double prior_sigma) {
    if (scan_.patches().empty()) return;
    const double weight = 1 / (prior_sigma * prior_sigma);
    MarginalisedEquations equations(at_.sums, covariance_, scan_.scales);
    for (int i = 0; i < 20; ++i) {
      const Eigen::MatrixXd p = (equations.information() + prior_).inverse();
      const Eigen::VectorXd step = p * (equations.gradient() - prior_ * from_prior(state_));
      determined_ = 0;
      double largest = 0;
      const auto evidence = equations.evidence(p, step);
      for (std::size_t f = 0; f < evidence.size(); ++f) {
        const double determined = std::max(0.0, evidence[f].determined);
        double& scale = scan_.scales[f];
        const double slope =
            evidence[f].squared - evidence[f].determined - weight * std::log(scale);
        const double change = std::clamp(slope / (2 * determined + weight), -1.0, 1.0);
        scale *= std::exp(change);
        largest = std::max(largest, std::abs(change));
        determined_ += determined;
      }
      if (largest < 0.05) break;
      equations.rescale(scan_.scales);
    }
  }

  /// The most probable scale of the range noise, as if some returns had been seen that are as the
  /// beam model says.
  void learn_noise() {
    constexpr double before = 20;
    const double free = std::max(1.0, at_.explained - determined_ - layout_.size());
    const double ratio = at_.square_sum / std::max(1e-300, at_.variance_sum);
    scan_.noise_scale *= std::sqrt((ratio * at_.explained + before) / (free + before));
  }

  /// But for a constant: of the beams, over what they would have if there were no target.
  double log_posterior() const {
    return -cost_of(at_, state_, offsets_squared_) - at_.log_likelihood_without;
  }

  /// Chi squared of the pose, as predicted.
  double from_prediction() const {
    const Vector6d off = from_prior(state_).head<6>();
    return off.dot(prior_.topLeftCorner<6, 6>() * off);
  }

  /// Of the whole state, prior included (Laplace's approximation).
  Eigen::MatrixXd covariance() const {
    return (MarginalisedEquations(at_.sums, covariance_, scan_.scales).information() + prior_)
        .inverse();
  }

  /// What the scan alone says of pose and velocity: all else that is unknown marginalised. What
  /// scans have in common: the surface, the rims' offset, the range's bias.
  MeasuredMotion measured() const {
    const MarginalisedEquations equations(at_.sums, covariance_, scan_.scales);
    const Eigen::Index rest = layout_.size() - 12;
    const Eigen::MatrixXd& information = equations.information();
    const auto prior = prior_.bottomRightCorner(rest, rest);
    const Eigen::VectorXd gradient = equations.gradient() - prior_ * from_prior(state_);
    // The score of pose and velocity, free of all else.
    Eigen::MatrixXd freed(12, layout_.size());
    freed << Eigen::MatrixXd::Identity(12, 12), -(information.bottomRightCorner(rest, rest) + prior)
                                                     .ldlt()
                                                     .solve(information.bottomLeftCorner(rest, 12))
                                                     .transpose();
    MeasuredMotion motion;
    motion.about = state_.motion;
    motion.said.information = freed * information.leftCols(12);
    motion.said.gradient =
        equations.gradient().head(12) + freed.rightCols(rest) * gradient.tail(rest);
    motion.said.returns = static_cast<int>(std::lround(at_.explained));
    Eigen::MatrixXd common = equations.offsets_share();
    for (int i = layout_.rim_at(); i < layout_.joints_at(); ++i) common(i, i) += prior_(i, i);
    motion.systematic = freed * common * freed.transpose();
    return motion;
  }

  const ScanState& state() const { return state_; }
  const ScanFit::Linearised& at() const { return at_; }
  int evaluations() const { return evaluations_; }

 private:
  Eigen::VectorXd from_prior(const ScanState& state) const {
    Eigen::VectorXd off = Eigen::VectorXd::Zero(layout_.size());
    const Vector12d d = difference(prior_state_.motion, state.motion);
    off.head<6>() = d.head<6>();
    if (layout_.velocity) off.segment<6>(6) = d.tail<6>();
    off[layout_.rim_at()] = state.rim_offset - prior_state_.rim_offset;
    if (layout_.range_bias) off[layout_.bias_at()] = state.range_bias - prior_state_.range_bias;
    for (int j = 0; j < layout_.joints; ++j) {
      const auto at = static_cast<std::size_t>(j);
      off[layout_.joints_at() + j] = state.angles[at] - prior_state_.angles[at];
    }
    return off;
  }
  double cost_of(const ScanFit::Linearised& at, const ScanState& state,
                 double offsets_squared) const {
    const Eigen::VectorXd off = from_prior(state);
    return -at.log_likelihood + 0.5 * offsets_squared + 0.5 * off.dot(prior_ * off);
  }

  ScanFit& scan_;
  ScanStateLayout layout_;
  ScanState prior_state_;
  Eigen::MatrixXd prior_;
  ScanState state_;
  OffsetCovariance covariance_;
  ScanFit::Linearised at_;
  double offsets_squared_ = 0;  // of the surface's patches, in sigmas
  double determined_ = 0;
  int evaluations_ = 0;
};

int ratio_above(int count, int max) { return (count + max - 1) / max; }

/// A scan, what is known before it, and in which steps the likelihood is narrowed.
struct Task {
  ScanFit scan;
  ScanStateLayout layout;
  ScanState prior_state;
  Eigen::MatrixXd prior;  // information
  const std::vector<ScanFit::Surface>& surface_of_face;
  double scale_prior = 1;
  // m, of the likelihood: from what the prediction leaves to that of the beams.
  double wide = 0, narrow = 0;
  double moves = 0;  // m, of ends, by what the velocity may be
  int coarse_thinning = 1;
  double radius = 0;  // m, of the sphere that holds the target

  /// Widened, with and without the surface's patches, and as it is.
  int stages() const {
    return 2 + static_cast<int>(std::ceil(std::log(wide / narrow) / std::log(annealing_ratio)));
  }
};

/// The optimisation of one scan from one start.
class Descent {
 public:
  Descent(const Task& task, const ScanState& start)
      : task_(task), scan_(task.scan), fit_(scan_, task.layout, start, task.prior_state) {}
  Descent(const Descent&) = delete;
  Descent& operator=(const Descent&) = delete;

  /// From wide to narrow, by some of the beams, as if the surface were the mesh.
  void coarse() {
    for (int s = 0; s < task_.stages() - 2; ++s) run(s);
    coarse_log_posterior_ = fit_.log_posterior();
    coarse_state_ = fit_.state();
  }
  double coarse_log_posterior() const { return coarse_log_posterior_; }
  const ScanState& coarse_state() const { return coarse_state_; }
  /// Then by all of them, as it is.
  void fine() {
    run(task_.stages() - 2);
    run(task_.stages() - 1);
  }
  /// Of the beams that should return from the target as modelled, the share that did.
  double fit_share() const {
    return std::min(1.0, fit_.at().fit / std::max(1.0, fit_.at().expected));
  }
  double noise_scale() const { return scan_.noise_scale; }
  const Fit& fit() const { return fit_; }

 private:
  void run(int s) {
    const int stages = task_.stages();
    const bool last = s == stages - 1;
    const double width =
        last ? 0
             : task_.wide * std::pow(task_.wide / task_.narrow, -s / std::max(1.0, stages - 2.0));
    const ScanFit::Stage stage{{width, width},
                               s >= stages - 2,
                               s >= stages - 3,
                               s >= stages - 2 ? 1 : task_.coarse_thinning};
    // What moves beams by less than the likelihood is widened cannot be seen: it stays as it was.
    Eigen::MatrixXd known = task_.prior;
    for (int i = task_.moves < width ? 6 : task_.layout.rim_at();
         i < task_.layout.joints_at() && !last; ++i) {
      known(i, i) *= held;
    }
    // What beams may meet is decided where a stage begins: again, where that has moved away.
    for (int i = 0; i < max_looks; ++i) {
      const Pose before = fit_.state().motion.pose;
      fit_.run(stage, task_.surface_of_face, known, last ? last_iterations : first_iterations);
      if (!last) break;
      const Vector6d moved = difference(before, fit_.state().motion.pose);
      const Matrix6d covariance = fit_.covariance().topLeftCorner<6, 6>();
      if (moved.dot(covariance.ldlt().solve(moved)) < settled_move) break;
    }
    if (!stage.patches) return;
    fit_.learn_scales(task_.scale_prior);
    if (!last) fit_.learn_noise();
  }

  const Task& task_;
  ScanFit scan_;
  Fit fit_;
  double coarse_log_posterior_ = 0;
  ScanState coarse_state_;
};

/// The most probable of the optima that are found from the prediction and, where beams do not fit,
/// from it as it is, not widened, and from a sigma of it to either side: turned about its principal
/// axes, with a joint's angle another. Past the edge of a panel that is seen edge on there is
/// another optimum, and most of them are about it.
std::unique_ptr<Descent> best_descent(const Task& task, const ScanState& start,
                                      const Matrix6d& covariance, const Vector3d& centre) {
  auto best = std::make_unique<Descent>(task, start);
  best->coarse();
  best->fine();
  // Closer together than beams are wide, starts are one.
  if (best->fit_share() > fit_as_usual || task.wide <= 2 * task.narrow) return best;
  const auto near = [](const Descent& d) {
    return d.fit().from_prediction() < max_from_prediction;
  };
  const auto finish = [&](std::unique_ptr<Descent> tried) {
    tried->fine();
    const bool better = tried->fit().log_posterior() > best->fit().log_posterior();
    if (near(*tried) && (better || !near(*best))) best = std::move(tried);
  };
  // m, of the target's places, at most.
  const auto apart = [&](const ScanState& a, const ScanState& b) {
    double angle = angle_between(a.motion.pose, b.motion.pose);
    for (std::size_t j = 0; j < a.angles.size(); ++j) angle += std::abs(a.angles[j] - b.angles[j]);
    return (a.motion.pose * centre - b.motion.pose * centre).norm() + task.radius * angle;
  };
  std::vector<ScanState> found{best->coarse_state()};
  const auto attempt = [&](const ScanState& other) {
    auto tried = std::make_unique<Descent>(task, other);
    tried->coarse();
    const ScanState& at = tried->coarse_state();
    const bool known = std::any_of(found.begin(), found.end(), [&](const ScanState& f) {
      return apart(f, at) < 2 * task.narrow;
    });
    if (known) return;
    found.push_back(at);
    if (tried->coarse_log_posterior() > best->coarse_log_posterior()) finish(std::move(tried));
  };
  finish(std::make_unique<Descent>(task, start));
  const Eigen::SelfAdjointEigenSolver<Matrix3d> turns(covariance.bottomRightCorner<3, 3>());
  const Vector3d middle = start.motion.pose * centre;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      const Quaterniond turn = rotation_from_vector(sign * std::sqrt(turns.eigenvalues()[axis]) *
                                                    turns.eigenvectors().col(axis));
      ScanState other = start;
      Pose& pose = other.motion.pose;
      pose.rotation = turn * pose.rotation;
      pose.position += middle - pose * centre;
      attempt(other);
    }
  }
  for (int j = 0; j < task.layout.joints; ++j) {
    const auto at = static_cast<std::size_t>(j);
    const double information = task.prior(task.layout.joints_at() + j, task.layout.joints_at() + j);
    for (const double sign : {-1.0, 1.0}) {
      ScanState other = best->fit().state();
      other.angles[at] = task.prior_state.angles[at] + sign / std::sqrt(information);
      attempt(other);
    }
  }
  return best;
}

}  // namespace

LikelihoodTracking::LikelihoodTracking(const TargetModel& model, const BeamModel& beam_model,
                                       const LikelihoodTrackingOptions& options)
    : model_(model),
      beam_model_(beam_model),
      options_(options),
      scene_(model.target),
      radius_(scene_.radius_about(model.centre)) {
  for (std::uint32_t f = 0; f < model.target.mesh.triangles.size(); ++f) {
    const TargetPart& part = model.target.part(f);
    surface_of_face_.push_back({model.target.surface_sigma(part, options.bare_surface_sigma_m),
                                part.correlation_length, part.material.reflectivity});
  }
  scale_prior_ = std::log(model.target.is_bare() ? options.bare_surface_factor
                                                 : options.described_surface_factor);
}

TrackingResult LikelihoodTracking::track(const CleanScan& scan, const Prediction& predicted) const {
  TrackingResult result;
  result.pose = predicted.pose;
  result.covariance = predicted.covariance;
  const auto lost = [&result](const std::string& reason) {
    result.reason = reason;
    return result;
  };
  if (!predicted.pose.position.allFinite() || !predicted.pose.rotation.coeffs().allFinite() ||
      !is_covariance(predicted.covariance)) {
    return lost("the prediction is not finite, or its covariance is none");
  }
  if (static_cast<int>(scan.points.size()) < options_.min_returns) {
    return lost(std::to_string(scan.points.size()) + " returns inside the range gate, at least " +
                std::to_string(options_.min_returns) + " are needed");
  }
  ScanStateLayout layout;
  layout.velocity = !predicted.velocity_covariance.isZero(0);
  layout.range_bias = beam_model_.range_bias_m > 0;
  layout.joints = static_cast<int>(scene_.joints().size());
  ScanState start;
  start.motion = {predicted.pose, predicted.velocity};
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(layout.size(), layout.size());
  prior.topLeftCorner<6, 6>() = predicted.covariance.inverse();
  if (layout.velocity) prior.block<6, 6>(6, 6) = predicted.velocity_covariance.inverse();
  // Where a wide beam's echo changes over from one face to the other is the receiver's threshold.
  const double threshold =
      std::max(1e-5, 0.25 * beam_model_.footprint(std::max(1e-3, predicted.pose.position.norm())));
  prior(layout.rim_at(), layout.rim_at()) = 1 / (threshold * threshold);
  if (layout.range_bias) {
    prior(layout.bias_at(), layout.bias_at()) = 1 / std::pow(beam_model_.range_bias_m, 2);
  }
  ScanState prior_state = start;
  for (const Joint& joint : scene_.joints()) {
    const auto j = static_cast<int>(start.angles.size());
    start.angles.push_back(0);
    prior_state.angles.push_back(0.5 * (joint.low + joint.high) - joint.rest);
    prior(layout.joints_at() + j, layout.joints_at() + j) =
        12 / std::max(1e-12, std::pow(joint.high - joint.low, 2));
  }
  ScanFit::Options fit_options;
  fit_options.centre = model_.centre;
  fit_options.extent = 2 * model_.radius;
  fit_options.radius = radius_;
  const auto returns = static_cast<int>(scan.points.size());
  fit_options.thinning = ratio_above(returns, options_.max_returns);
  const double range = std::max(1e-3, predicted.pose.position.norm());
  const double narrow = 0.25 * beam_model_.footprint(range);
  const Task task{ScanFit(scene_, beam_model_, scan, layout, fit_options),
                  layout,
                  prior_state,
                  prior,
                  surface_of_face_,
                  scale_prior_,
                  std::clamp(uncertainty_of_ends(model_, predicted.covariance), 2 * narrow,
                             0.1 * model_.radius),
                  narrow,
                  0.5e-6 * static_cast<double>(scan.utime_last - scan.utime_first) *
                      uncertainty_of_ends(model_, predicted.velocity_covariance),
                  ratio_above(returns / fit_options.thinning, options_.max_coarse_returns),
                  radius_};
  const auto found = best_descent(task, start, predicted.covariance, model_.centre);
  const Fit& fit = found->fit();
  const ScanFit::Linearised& at = fit.at();
  result.pose = fit.state().motion.pose;
  result.covariance = fit.covariance().topLeftCorner<6, 6>();
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  if (layout.velocity) result.motion = fit.measured();
  result.iterations = fit.evaluations();
  // Those left out are as those looked at.
  const auto of_all = [&](double count) {
    return std::min(returns, static_cast<int>(std::lround(fit_options.thinning * count)));
  };
  result.used = of_all(at.explained);
  result.near = of_all(at.returns);
  result.residual_rms = std::sqrt(at.square_sum / std::max(1.0, at.explained));
  result.spread = found->noise_scale() * found->noise_scale();
  result.confidence = found->fit_share();
  if (!is_covariance(result.covariance)) return lost("the covariance is none");
  if (!(fit.from_prediction() < max_from_prediction) && !(result.confidence > fit_as_usual)) {
    return lost(fixed(std::sqrt(fit.from_prediction()), 1) +
                " sigmas from the prediction, at most " + fixed(std::sqrt(max_from_prediction), 1) +
                " are believed");
  }
  if (result.confidence < options_.min_fit) {
    return lost(fixed(100 * result.confidence, 0) +
                " % of the beams that should meet the target fit it as modelled, at least " +
                fixed(100 * options_.min_fit, 0) + " % are needed");
  }
  result.ok = true;
  return result;
}

}  // namespace berth::estimator
