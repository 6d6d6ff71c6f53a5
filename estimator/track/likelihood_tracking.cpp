// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/track/likelihood_tracking.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "common/core/covariance.h"
#include "common/core/text.h"

namespace berth::estimator {
namespace {

/// The optimisation of one scan.
class Fit {
 public:
  Fit(ScanFit& scan, const ScanStateLayout& layout, const ScanState& prior_state,
      const Eigen::MatrixXd& prior)
      : scan_(scan), layout_(layout), prior_state_(prior_state), prior_(prior),
        state_(prior_state) {}

  void run(const ScanFit::Stage& stage, const std::vector<ScanFit::Surface>& surfaces,
           double scale, int iterations) {
    scan_.prepare(state_, stage, surfaces);
    correlation_ = offset_covariance(scan_.patches(), scan_.patches());
    scale_ = scale;
    delta_ = Eigen::VectorXd::Zero(correlation_.rows());
    alpha_ = delta_;
    at_ = scan_.linearise(state_, delta_);
    double cost = cost_of(at_, state_, delta_, alpha_);
    double damping = 0;
    for (int i = 0; i < iterations; ++i) {
      ++steps_;
      const MarginalisedEquations equations(at_.sums, scale_ * scale_ * correlation_);
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
        Eigen::VectorXd delta;
        Eigen::VectorXd alpha;
        equations.offsets(step, delta, alpha);
        const ScanState trial = layout_.moved(state_, step);
        ScanFit::Linearised there = scan_.linearise(trial, delta);
        const double trial_cost = cost_of(there, trial, delta, alpha);
        ++evaluations_;
        if (trial_cost < cost + 0.01) {
          better = true;
          state_ = trial;
          delta_ = delta;
          alpha_ = alpha;
          at_ = std::move(there);
          cost = trial_cost;
          damping /= 10;
          if (damping < 1e-4) damping = 0;
        } else {
          damping = std::max(1e-2, 10 * damping);
        }
      }
      if (!better || gain < 0.02) break;
    }
    scan_.shares = at_.shares;
  }

  /// One step towards the most probable scale of the surface's sigma. @return change of its log.
  double learn_scale(double prior_sigma) {
    if (correlation_.rows() == 0) return 0;
    const MarginalisedEquations equations(at_.sums, scale_ * scale_ * correlation_);
    const Eigen::MatrixXd p = (equations.information() + prior_).inverse();
    const Eigen::VectorXd step = p * (equations.gradient() - prior_ * from_prior(state_));
    equations.offsets(step, delta_, alpha_);
    const double determined = std::max(0.0, equations.determined(p));
    const double log_scale = std::log(scale_);
    const double slope = delta_.dot(alpha_) - determined - log_scale / (prior_sigma * prior_sigma);
    const double change =
        std::clamp(slope / (2 * determined + 1 / (prior_sigma * prior_sigma)), -1.0, 1.0);
    scale_ *= std::exp(change);
    determined_ = determined;
    return change;
  }

  void finish(Eigen::MatrixXd& covariance, Eigen::MatrixXd& information) const {
    const MarginalisedEquations equations(at_.sums, scale_ * scale_ * correlation_);
    information = equations.information();
    covariance = (information + prior_).inverse();
    if (std::getenv("DBG") != nullptr) {
      for (double f : {1.0, 10.0, 1000.0}) {
        NormalEquations e = at_.sums;
        e.information *= f; e.gradient *= f; e.patch_information *= f; e.patch_gradient *= f; e.coupling *= f;
        const MarginalisedEquations m(e, scale_ * scale_ * correlation_);
        const Eigen::MatrixXd c = (m.information() + prior_).inverse();
        std::fprintf(stderr, "   N x %g: %.2f %.2f %.2f mm %.3f %.3f %.3f deg\n", f, 1e3*std::sqrt(c(0,0)), 1e3*std::sqrt(c(1,1)), 1e3*std::sqrt(c(2,2)), 57.3*std::sqrt(c(3,3)), 57.3*std::sqrt(c(4,4)), 57.3*std::sqrt(c(5,5)));
      }
      const auto& q = at_.sums;
      Eigen::MatrixXd A = q.patch_information.cwiseMax(1e-9).cwiseInverse().asDiagonal() * q.coupling;
      { std::vector<int> keep; for (int i = 0; i < A.rows(); ++i) if (q.patch_information[i] > 1e4) keep.push_back(i);
        Eigen::MatrixXd K(keep.size(), keep.size()); Eigen::VectorXd y(keep.size()); double raw=0; for (size_t i = 0; i < keep.size(); ++i) { y[i]=q.patch_gradient[keep[i]]/q.patch_information[keep[i]]; raw+=y[i]*y[i]; for (size_t j = 0; j < keep.size(); ++j) K(i,j) = scale_*scale_*correlation_(keep[i],keep[j]); K(i,i) += 1/q.patch_information[keep[i]]; }
        double tr=K.trace(); std::fprintf(stderr,"   chi2 %.2f of n=%zu; rms offset %.2f mm expected %.2f; returns %.0f explained %.1f outliers %.1f\n", y.dot(K.ldlt().solve(y))/keep.size(), keep.size(), 1e3*std::sqrt(raw/keep.size()), 1e3*std::sqrt(tr/keep.size()), at_.returns, at_.explained, at_.outliers);
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eig(K); Eigen::VectorXd t=eig.eigenvectors().transpose()*y; int n=keep.size(); std::fprintf(stderr,"   by tenths of the spectrum, largest last:"); for(int d=0;d<10;++d){ double c=0; int m=0; for(int i=d*n/10;i<(d+1)*n/10;++i){ c+=t[i]*t[i]/eig.eigenvalues()[i]; ++m;} std::fprintf(stderr," %.2f",c/m);} double c=0; for(int i=n-6;i<n;++i) c+=t[i]*t[i]/eig.eigenvalues()[i]; std::fprintf(stderr,"; last six %.2f\n",c/6); }
      for (int kind = 0; kind < 2; ++kind) {
      std::vector<int> keep; for (int i = 0; i < A.rows(); ++i) if (q.patch_information[i] > 1e3) keep.push_back(i);
      Eigen::MatrixXd K(keep.size(), keep.size()), B(keep.size(), 6);
      for (size_t i = 0; i < keep.size(); ++i) { B.row(i) = A.row(keep[i]).head<6>(); for (size_t j = 0; j < keep.size(); ++j) K(i,j) = scale_*scale_*correlation_(keep[i],keep[j]); K(i,i) += kind ? 1e-6 : 1/q.patch_information[keep[i]]; }
      const Eigen::MatrixXd c = (B.transpose() * K.ldlt().solve(B)).inverse();
      std::fprintf(stderr, "   patches %zu kind %d: %.2f %.2f %.2f mm %.3f %.3f %.3f deg\n", keep.size(), kind, 1e3*std::sqrt(c(0,0)), 1e3*std::sqrt(c(1,1)), 1e3*std::sqrt(c(2,2)), 57.3*std::sqrt(c(3,3)), 57.3*std::sqrt(c(4,4)), 57.3*std::sqrt(c(5,5)));
      }
    }
  }

  const ScanState& state() const { return state_; }
  const ScanFit::Linearised& at() const { return at_; }
  double scale() const { return scale_; }
  double determined() const { return determined_; }
  int steps() const { return steps_; }
  int evaluations() const { return evaluations_; }

 private:
  Eigen::VectorXd from_prior(const ScanState& state) const {
    Eigen::VectorXd off = Eigen::VectorXd::Zero(layout_.size());
    const Vector12d d = difference(prior_state_.motion, state.motion);
    off.head<6>() = d.head<6>();
    if (layout_.velocity) off.segment<6>(6) = d.tail<6>();
    if (layout_.range_bias) off[layout_.bias_at()] = state.range_bias - prior_state_.range_bias;
    for (int j = 0; j < layout_.joints; ++j) {
      const auto at = static_cast<std::size_t>(j);
      off[layout_.joints_at() + j] = state.angles[at] - prior_state_.angles[at];
    }
    return off;
  }
  double cost_of(const ScanFit::Linearised& at, const ScanState& state,
                 const Eigen::VectorXd& delta, const Eigen::VectorXd& alpha) const {
    const Eigen::VectorXd off = from_prior(state);
    return -at.log_likelihood + 0.5 * delta.dot(alpha) + 0.5 * off.dot(prior_ * off);
  }

  ScanFit& scan_;
  ScanStateLayout layout_;
  ScanState prior_state_;
  Eigen::MatrixXd prior_;
  ScanState state_;
  Eigen::MatrixXd correlation_;
  double scale_ = 1;
  Eigen::VectorXd delta_, alpha_;
  ScanFit::Linearised at_;
  double determined_ = 0;
  int steps_ = 0;
  int evaluations_ = 0;
};

}  // namespace

LikelihoodTracking::LikelihoodTracking(const TargetModel& model, const BeamModel& beam_model,
                                       const LikelihoodTrackingOptions& options)
    : model_(model), beam_model_(beam_model), options_(options), scene_(model.target) {
  const bool bare = model.target.description_hash.empty();
  for (std::uint32_t f = 0; f < model.target.mesh.triangles.size(); ++f) {
    const TargetPart& part = model.target.part(f);
    surface_of_face_.push_back(
        {bare ? options.bare_surface_sigma_m : part.surface_sigma, part.correlation_length});
  }
  scale_prior_ = std::log(bare ? options.bare_surface_factor : options.described_surface_factor);
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
  static const bool with_joints = std::getenv("BERTH_NO_JOINTS") == nullptr;
  ScanStateLayout layout;
  layout.velocity = !predicted.velocity_covariance.isZero(0);
  layout.joints = with_joints ? static_cast<int>(scene_.joints().size()) : 0;
  ScanState start;
  start.motion = {predicted.pose, predicted.velocity};
  Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(layout.size(), layout.size());
  prior.topLeftCorner<6, 6>() = predicted.covariance.inverse();
  if (layout.velocity) prior.block<6, 6>(6, 6) = predicted.velocity_covariance.inverse();
  for (const Joint& joint : scene_.joints()) {
    start.angles.push_back(0);
    const auto j = static_cast<int>(start.angles.size()) - 1;
    if (j >= layout.joints) continue;
    prior(layout.joints_at() + j, layout.joints_at() + j) =
        12 / std::max(1e-12, std::pow(joint.high - joint.low, 2));
  }
  ScanFit::Options fit_options;
  fit_options.extent = 2 * model_.radius;
  if (std::getenv("CELL")) fit_options.cell = atof(std::getenv("CELL"));
  ScanFit scan_fit(scene_, beam_model_, scan, layout, fit_options);
  Fit fit(scan_fit, layout, start, prior);

  const double range = std::max(1e-3, predicted.pose.position.norm());
  const double narrow = 0.25 * beam_model_.footprint(range);
  const double wide = std::clamp(uncertainty_of_ends(model_, predicted.covariance), 2 * narrow,
                                 0.1 * model_.radius);
  const int stages = 2 + static_cast<int>(std::ceil(std::log(wide / narrow) / std::log(2.0)));
  double scale = 1;
  for (int s = 0; s < stages; ++s) {
    const bool last = s == stages - 1;
    static const int early = std::getenv("EARLY") ? std::atoi(std::getenv("EARLY")) : 4;
    ScanFit::Stage stage;
    const double width = last ? 0 : wide * std::pow(0.5, s);
    stage.annealing = {width, width};
    stage.patches = s >= stages - 2;
    stage.pieces = s >= stages - 3;
    scan_fit.surface_scale = scale;
    fit.run(stage, surface_of_face_, scale, last ? 8 : early);
    if (!stage.patches) continue;
    for (int k = 0; k < (std::getenv("NOLEARN") ? 0 : 8); ++k) {
      if (std::abs(fit.learn_scale(scale_prior_)) < 0.05) break;
    }
    scale = fit.scale();
    constexpr double before = 20;
    const ScanFit::Linearised& at = fit.at();
    if (stage.annealing.range == 0) {
      scan_fit.noise_scale *= std::sqrt(
          (at.square_sum + before) /
          std::max(1.0, at.explained - fit.determined() - layout.size() + before));
      scan_fit.surface_scale = scale;
      fit.run(stage, surface_of_face_, scale, 4);
      if (!std::getenv("NOLEARN")) fit.learn_scale(scale_prior_);
    }
  }

  Eigen::MatrixXd covariance;
  Eigen::MatrixXd information;
  fit.finish(covariance, information);
  const ScanFit::Linearised& at = fit.at();
  result.pose = fit.state().motion.pose;
  result.covariance = covariance.topLeftCorner<6, 6>();
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();
  result.iterations = fit.evaluations();
  result.used = static_cast<int>(std::lround(at.explained));
  result.near = static_cast<int>(std::lround(at.returns));
  result.residual_rms =
      beam_model_.range_sigma_m * std::sqrt(at.square_sum / std::max(1.0, at.explained));
  result.spread = scan_fit.noise_scale * scan_fit.noise_scale;
  result.confidence = at.fit / std::max(1.0, at.expected);
  static const bool verbose = std::getenv("BERTH_VERBOSE") != nullptr;
  if (verbose) {
    std::fprintf(stderr,
                 "likelihood: patches %zu stages %d steps %d evaluations %d scale %.3f noise %.2f "
                 "fit %.2f outlier %.3f\n",
                 scan_fit.patches().size(), stages, fit.steps(), fit.evaluations(), scale,
                 scan_fit.noise_scale, result.confidence, scan_fit.shares.outlier);
  }
  if (!is_covariance(result.covariance)) return lost("the covariance is none");
  if (result.confidence < options_.min_fit) {
    return lost(fixed(100 * result.confidence, 0) +
                " % of the beams that should meet the target fit it as modelled, at least " +
                fixed(100 * options_.min_fit, 0) + " % are needed");
  }
  result.ok = true;
  return result;
}

}  // namespace berth::estimator
