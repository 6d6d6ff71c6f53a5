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

// Choices of computing time: half or twice of each changes estimates by far less than their sigma.
// Variance of the surface field that the decomposition may neglect, over the noise of a patch's
// mean.
constexpr double neglected_share = 0.2;
/// Ratio of successive annealing widths, about.
constexpr double annealing_ratio = 2;
/// Iterations of an annealed stage, and of the last: views along a panel take many.
constexpr int first_iterations = 3;
constexpr int last_iterations = 10;
/// Maximum number of associations in the last stage.
constexpr int max_associations = 4;
/// Factor on the prior information of a state that a stage keeps fixed: a hundredth of its sigma.
constexpr double fixing_factor = 1e4;
/// Iterations end where twice the predicted gain in log-likelihood is below min_gain; associations,
/// where the step's chi squared (six degrees of freedom) is below min_move. A rejected step whose
/// predicted gain is below small_gain is not damped and repeated.
constexpr double min_gain = 0.1;
constexpr double min_move = 1;
constexpr double small_gain = 2;
/// Other starts are tried where the share of expected returns that fit is below what outliers
/// usually leave: computing time only.
constexpr double usual_fit = 1 - BeamShares{}.outlier;
/// Gate of the pose about its prediction, unless beams fit as usual.
constexpr double max_prediction_chi_squared = pose_chi_squared_limit;

/// Levenberg-Marquardt optimisation of one scan's posterior.
class LevenbergMarquardt {
 public:
  LevenbergMarquardt(ScanLikelihood& scan, const ScanStateLayout& layout, const ScanState& start,
                     const ScanState& prior_state)
      : scan_(scan), layout_(layout), prior_state_(prior_state), state_(start) {}

  /// @param prior information about the prior state in this stage
  void run(const ScanLikelihood::Stage& stage, const std::vector<ScanLikelihood::Surface>& surfaces,
           const Eigen::MatrixXd& prior, int iterations) {
    prior_ = prior;
    scan_.prepare(state_, stage, surfaces);
    at_ = scan_.linearise(state_,
                          Eigen::VectorXd::Zero(static_cast<Eigen::Index>(scan_.patches().size())));
    covariance_ = OffsetCovariance(scan_.patches(), at_.sums, scan_.scales, neglected_share);
    offsets_squared_ = 0;
    double cost = cost_of(at_, state_, offsets_squared_);
    double damping = 0;
    for (int i = 0; i < iterations; ++i) {
      const MarginalisedEquations equations(at_.sums, covariance_, scan_.scales);
      const Eigen::VectorXd off = prior_deviation(state_);
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
        ScanLikelihood::Linearised there = scan_.linearise(trial, equations.offsets(step));
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
      if (!better || gain < min_gain) break;
    }
    scan_.shares = at_.shares;
  }

  /// Most probable scales of the surface fields by their evidence (MacKay's fixed point).
  void learn_scales(double prior_sigma) {
    if (scan_.patches().empty()) return;
    const double weight = 1 / (prior_sigma * prior_sigma);
    MarginalisedEquations equations(at_.sums, covariance_, scan_.scales);
    for (int i = 0; i < 20; ++i) {
      const Eigen::MatrixXd p = (equations.information() + prior_).inverse();
      const Eigen::VectorXd step = p * (equations.gradient() - prior_ * prior_deviation(state_));
      well_determined_ = 0;
      double largest = 0;
      const auto evidence = equations.evidence(p, step);
      for (std::size_t f = 0; f < evidence.size(); ++f) {
        const double well_determined = std::max(0.0, evidence[f].well_determined);
        double& scale = scan_.scales[f];
        const double slope =
            evidence[f].squared - evidence[f].well_determined - weight * std::log(scale);
        const double change = std::clamp(slope / (2 * well_determined + weight), -1.0, 1.0);
        scale *= std::exp(change);
        largest = std::max(largest, std::abs(change));
        well_determined_ += well_determined;
      }
      if (largest < 0.05) break;
      equations.rescale(scan_.scales);
    }
  }

  /// Most probable scale of the range noise, with a prior of 20 returns of the beam model.
  void learn_noise() {
    constexpr double before = 20;
    const double free = std::max(1.0, at_.explained - well_determined_ - layout_.size());
    const double ratio = at_.square_sum / std::max(1e-300, at_.variance_sum);
    scan_.noise_scale *= std::sqrt((ratio * at_.explained + before) / (free + before));
  }

  /// Up to a constant, relative to the beams' likelihood without a target.
  double log_posterior() const {
    return -cost_of(at_, state_, offsets_squared_) - at_.log_likelihood_without;
  }

  /// Chi squared of the pose about its prediction.
  double prediction_chi_squared() const {
    const Vector6d off = prior_deviation(state_).head<6>();
    return off.dot(prior_.topLeftCorner<6, 6>() * off);
  }

  /// Of the whole state, prior included (Laplace's approximation).
  Eigen::MatrixXd covariance() const {
    return (MarginalisedEquations(at_.sums, covariance_, scan_.scales).information() + prior_)
        .inverse();
  }

  /// Measurement of pose and velocity by the scan alone, nuisance states marginalised. Systematic:
  /// the surface, the edges' offset, the range bias.
  MeasuredMotion measured() const {
    const MarginalisedEquations equations(at_.sums, covariance_, scan_.scales);
    const Eigen::Index rest = layout_.size() - 12;
    const Eigen::MatrixXd& information = equations.information();
    const auto prior = prior_.bottomRightCorner(rest, rest);
    const Eigen::VectorXd gradient = equations.gradient() - prior_ * prior_deviation(state_);
    // The score of pose and velocity, nuisance states eliminated.
    Eigen::MatrixXd freed(12, layout_.size());
    freed << Eigen::MatrixXd::Identity(12, 12), -(information.bottomRightCorner(rest, rest) + prior)
                                                     .ldlt()
                                                     .solve(information.bottomLeftCorner(rest, 12))
                                                     .transpose();
    MeasuredMotion motion;
    motion.reference = state_.motion;
    motion.measurement.information = freed * information.leftCols(12);
    motion.measurement.gradient =
        equations.gradient().head(12) + freed.rightCols(rest) * gradient.tail(rest);
    motion.measurement.returns = static_cast<int>(std::lround(at_.explained));
    Eigen::MatrixXd common = equations.systematic_score_covariance();
    for (int i = layout_.rim_at(); i < layout_.joints_at(); ++i) common(i, i) += prior_(i, i);
    motion.systematic = freed * common * freed.transpose();
    return motion;
  }

  const ScanState& state() const { return state_; }
  const ScanLikelihood::Linearised& at() const { return at_; }
  int evaluations() const { return evaluations_; }

 private:
  Eigen::VectorXd prior_deviation(const ScanState& state) const {
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
  double cost_of(const ScanLikelihood::Linearised& at, const ScanState& state,
                 double offsets_squared) const {
    const Eigen::VectorXd off = prior_deviation(state);
    return -at.log_likelihood + 0.5 * offsets_squared + 0.5 * off.dot(prior_ * off);
  }

  ScanLikelihood& scan_;
  ScanStateLayout layout_;
  ScanState prior_state_;
  Eigen::MatrixXd prior_;
  ScanState state_;
  OffsetCovariance covariance_;
  ScanLikelihood::Linearised at_;
  double offsets_squared_ = 0;  // of the surface's patches, in sigmas
  double well_determined_ = 0;
  int evaluations_ = 0;
};

int ratio_above(int count, int max) { return (count + max - 1) / max; }

/// A scan, its prior, and the annealing schedule.
struct TrackingProblem {
  ScanLikelihood scan;
  ScanStateLayout layout;
  ScanState prior_state;
  Eigen::MatrixXd prior;  // information
  const std::vector<ScanLikelihood::Surface>& surface_of_face;
  double scale_prior = 1;
  // m, annealing widths: from the prediction's uncertainty to the beams'.
  double max_width = 0, min_width = 0;
  double velocity_shift =
      0;  // m, of the target's ends over half of the scan, by the velocity's uncertainty
  int coarse_thinning = 1;
  double radius = 0;  // m, of the sphere that holds the target

  /// Annealed stages, one without annealing weights included, and the final stage.
  int stages() const {
    return 2 +
           static_cast<int>(std::ceil(std::log(max_width / min_width) / std::log(annealing_ratio)));
  }
};

/// The optimisation of one scan from one start.
class AnnealedSearch {
 public:
  AnnealedSearch(const TrackingProblem& task, const ScanState& start)
      : task_(task), scan_(task.scan), fit_(scan_, task.layout, start, task.prior_state) {}
  AnnealedSearch(const AnnealedSearch&) = delete;
  AnnealedSearch& operator=(const AnnealedSearch&) = delete;

  /// The annealed stages with thinned beams and the mesh as the surface.
  void run_coarse() {
    for (int s = 0; s < task_.stages() - 2; ++s) run(s);
    coarse_log_posterior_ = fit_.log_posterior();
    coarse_state_ = fit_.state();
  }
  double coarse_log_posterior() const { return coarse_log_posterior_; }
  const ScanState& coarse_state() const { return coarse_state_; }
  /// The last stages with all beams and the surface uncertain.
  void run_fine() {
    run(task_.stages() - 2);
    run(task_.stages() - 1);
  }
  /// Share of the expected returns that fit the target as modelled.
  double fit_share() const {
    return std::min(1.0, fit_.at().fit / std::max(1.0, fit_.at().expected));
  }
  double noise_scale() const { return scan_.noise_scale; }
  const LevenbergMarquardt& fit() const { return fit_; }

 private:
  void run(int s) {
    const int stages = task_.stages();
    const bool last = s == stages - 1;
    const double width = last ? 0
                              : task_.max_width * std::pow(task_.max_width / task_.min_width,
                                                           -s / std::max(1.0, stages - 2.0));
    const ScanLikelihood::Stage stage{{width, width},
                                      s >= stages - 2,
                                      s >= stages - 3,
                                      s >= stages - 2 ? 1 : task_.coarse_thinning};
    // States that displace ranges by less than the annealing width are kept fixed.
    Eigen::MatrixXd known = task_.prior;
    for (int i = task_.velocity_shift < width ? 6 : task_.layout.rim_at();
         i < task_.layout.joints_at() && !last; ++i) {
      known(i, i) *= fixing_factor;
    }
    // Beams are associated where a stage begins; in the last stage again after a large step.
    for (int i = 0; i < max_associations; ++i) {
      const Pose before = fit_.state().motion.pose;
      fit_.run(stage, task_.surface_of_face, known, last ? last_iterations : first_iterations);
      if (!last) break;
      const Vector6d moved = difference(before, fit_.state().motion.pose);
      const Matrix6d covariance = fit_.covariance().topLeftCorner<6, 6>();
      if (moved.dot(covariance.ldlt().solve(moved)) < min_move) break;
    }
    if (!stage.patches) return;
    fit_.learn_scales(task_.scale_prior);
    if (!last) fit_.learn_noise();
  }

  const TrackingProblem& task_;
  ScanLikelihood scan_;
  LevenbergMarquardt fit_;
  double coarse_log_posterior_ = 0;
  ScanState coarse_state_;
};

/// Multi-start optimisation. The first start is the prediction. Where beams do not fit, further
/// starts are the prediction without annealing, rotations by a sigma to either side about its
/// principal axes, and joint angles a sigma off: a panel seen edge on has another optimum past its
/// edge. The most probable optimum inside the gate about the prediction is returned.
std::unique_ptr<AnnealedSearch> best_optimum(const TrackingProblem& task, const ScanState& start,
                                             const Matrix6d& covariance, const Vector3d& centre) {
  auto best = std::make_unique<AnnealedSearch>(task, start);
  best->run_coarse();
  best->run_fine();
  // Starts closer together than a beam's width are the same.
  if (best->fit_share() > usual_fit || task.max_width <= 2 * task.min_width) return best;
  const auto near = [](const AnnealedSearch& d) {
    return d.fit().prediction_chi_squared() < max_prediction_chi_squared;
  };
  const auto finish = [&](std::unique_ptr<AnnealedSearch> candidate) {
    candidate->run_fine();
    const bool better = candidate->fit().log_posterior() > best->fit().log_posterior();
    if (near(*candidate) && (better || !near(*best))) best = std::move(candidate);
  };
  // m: bound of the distance between corresponding points of the target.
  const auto apart = [&](const ScanState& a, const ScanState& b) {
    double angle = angle_between(a.motion.pose, b.motion.pose);
    for (std::size_t j = 0; j < a.angles.size(); ++j) angle += std::abs(a.angles[j] - b.angles[j]);
    return (a.motion.pose * centre - b.motion.pose * centre).norm() + task.radius * angle;
  };
  std::vector<ScanState> found{best->coarse_state()};
  const auto try_start = [&](const ScanState& other) {
    auto candidate = std::make_unique<AnnealedSearch>(task, other);
    candidate->run_coarse();
    const ScanState& at = candidate->coarse_state();
    const bool known = std::any_of(found.begin(), found.end(), [&](const ScanState& f) {
      return apart(f, at) < 2 * task.min_width;
    });
    if (known) return;
    found.push_back(at);
    if (candidate->coarse_log_posterior() > best->coarse_log_posterior())
      finish(std::move(candidate));
  };
  finish(std::make_unique<AnnealedSearch>(task, start));
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
      try_start(other);
    }
  }
  for (int j = 0; j < task.layout.joints; ++j) {
    const auto at = static_cast<std::size_t>(j);
    const double information = task.prior(task.layout.joints_at() + j, task.layout.joints_at() + j);
    for (const double sign : {-1.0, 1.0}) {
      ScanState other = best->fit().state();
      other.angles[at] = task.prior_state.angles[at] + sign / std::sqrt(information);
      try_start(other);
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

TrackingResult LikelihoodTracking::track(const PreprocessedScan& scan,
                                         const Prediction& predicted) const {
  TrackingResult result;
  result.pose = predicted.pose;
  result.covariance = predicted.covariance;
  const auto lost = [&result](const std::string& reason) {
    result.reason = reason;
    return result;
  };
  if (!predicted.pose.position.allFinite() || !predicted.pose.rotation.coeffs().allFinite() ||
      !is_covariance(predicted.covariance)) {
    return lost("the prediction is not finite, or its covariance not positive definite");
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
  // The position where a wide beam's echo changes faces depends on the receiver's threshold.
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
  ScanLikelihood::Options fit_options;
  fit_options.centre = model_.centre;
  fit_options.extent = 2 * model_.radius;
  fit_options.radius = radius_;
  const auto returns = static_cast<int>(scan.points.size());
  fit_options.thinning = ratio_above(returns, options_.max_returns);
  const double range = std::max(1e-3, predicted.pose.position.norm());
  const double min_width = 0.25 * beam_model_.footprint(range);
  const TrackingProblem task{
      ScanLikelihood(scene_, beam_model_, scan, layout, fit_options),
      layout,
      prior_state,
      prior,
      surface_of_face_,
      scale_prior_,
      std::clamp(extremity_sigma(model_, predicted.covariance), 2 * min_width, 0.1 * model_.radius),
      min_width,
      0.5e-6 * static_cast<double>(scan.utime_last - scan.utime_first) *
          extremity_sigma(model_, predicted.velocity_covariance),
      ratio_above(returns / fit_options.thinning, options_.max_coarse_returns),
      radius_};
  const auto found = best_optimum(task, start, predicted.covariance, model_.centre);
  const LevenbergMarquardt& fit = found->fit();
  const ScanLikelihood::Linearised& at = fit.at();
  result.pose = fit.state().motion.pose;
  result.covariance = fit.covariance().topLeftCorner<6, 6>();
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  if (layout.velocity) result.motion = fit.measured();
  result.iterations = fit.evaluations();
  // Thinned beams are assumed to be like the used ones.
  const auto of_all = [&](double count) {
    return std::min(returns, static_cast<int>(std::lround(fit_options.thinning * count)));
  };
  result.used = of_all(at.explained);
  result.near = of_all(at.returns);
  result.residual_rms = std::sqrt(at.square_sum / std::max(1.0, at.explained));
  result.spread = found->noise_scale() * found->noise_scale();
  result.confidence = found->fit_share();
  if (!is_covariance(result.covariance)) return lost("the covariance is not positive definite");
  if (!(fit.prediction_chi_squared() < max_prediction_chi_squared) &&
      !(result.confidence > usual_fit)) {
    return lost(fixed(std::sqrt(fit.prediction_chi_squared()), 1) +
                " sigmas from the prediction, at most " +
                fixed(std::sqrt(max_prediction_chi_squared), 1) + " are accepted");
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
