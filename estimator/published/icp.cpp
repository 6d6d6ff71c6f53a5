// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/icp.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/core/statistics.h"
#include "common/core/text.h"
#include "estimator/beam/scan.h"
#include "estimator/published/beam_registration.h"

namespace berth::estimator {
namespace {

struct Pair {
  Vector3d data;    // model frame
  Vector3d model;   // model frame
  Vector3d normal;  // unit
  double squared_distance;
};

/// Closed-form registration of point pairs (Horn's unit quaternion: the eigenvector of a 4x4 matrix
/// of correlations).
Pose register_points(const std::vector<Pair>& pairs) {
  Vector3d data_centre = Vector3d::Zero();
  Vector3d model_centre = Vector3d::Zero();
  for (const Pair& p : pairs) {
    data_centre += p.data;
    model_centre += p.model;
  }
  data_centre /= static_cast<double>(pairs.size());
  model_centre /= static_cast<double>(pairs.size());
  Matrix3d s = Matrix3d::Zero();
  for (const Pair& p : pairs) {
    s += (p.data - data_centre) * (p.model - model_centre).transpose();
  }
  Eigen::Matrix4d n;
  n << s.trace(), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),                   //
      s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),  //
      s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), s(1, 1) - s(0, 0) - s(2, 2), s(1, 2) + s(2, 1),  //
      s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), s(2, 2) - s(0, 0) - s(1, 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(n);
  const Eigen::Vector4d q = eigen.eigenvectors().col(3);
  Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (rotation.w() < 0) rotation.coeffs() *= -1;
  rotation.normalize();
  return {model_centre - rotation * data_centre, rotation};
}

/// Point-to-point steps slide along surfaces in ever smaller steps of one direction. Where two
/// steps agree, extrapolates their geometric series (the acceleration of Besl and McKay 1992).
class Accelerator {
 public:
  explicit Accelerator(double radius) { scale_ << 1, 1, 1, Vector3d::Constant(radius); }

  Pose extrapolated(const Pose& motion) {
    const Vector6d step = difference(Pose{}, motion);
    const Vector6d scaled = step.cwiseProduct(scale_);
    const double length = scaled.norm();
    const double last_length = last_.norm();
    const bool agree = last_length > 0 && length > 0 && length < last_length &&
                       scaled.dot(last_) > min_agreement * length * last_length;
    if (!agree) {
      last_ = scaled;
      return motion;
    }
    last_.setZero();  // the next step is judged afresh
    const double ratio = length / last_length;
    return perturbed(Pose{}, std::min(max_stride, 1 / (1 - ratio)) * step);
  }

 private:
  static constexpr double min_agreement = 0.95;  // cosine
  static constexpr double max_stride = 12;
  Vector6d scale_;
  Vector6d last_ = Vector6d::Zero();
};

/// Linearised point-to-plane registration.
Pose register_planes(const std::vector<Pair>& pairs) {
  Matrix6d a = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  for (const Pair& p : pairs) {
    Vector6d j;
    j << p.normal, p.data.cross(p.normal);
    a.noalias() += j * j.transpose();
    b += j * p.normal.dot(p.model - p.data);
  }
  // Regularisation of unobservable directions.
  a.diagonal().array() += 1e-6 * static_cast<double>(pairs.size());
  return perturbed(Pose{}, a.ldlt().solve(b));
}

class Matcher {
 public:
  Matcher(const TargetModel& model, const std::vector<Vector3d>& points, const IcpOptions& options)
      : model_(model), points_(points), options_(options), gate_(options.start_gate_m) {
    pairs_.reserve(points.size());
  }

  /// Pairs every point inside the grid with the model, then removes pairs outside the gate.
  void match(const Pose& pose) {
    const Pose to_model = pose.inverse();
    const Matrix3d rotation = to_model.rotation.toRotationMatrix();
    pairs_.clear();
    ClosestPointGrid::Match found;
    for (const Vector3d& p : points_) {
      const Vector3d q = rotation * p + to_model.position;
      const bool inside = options_.refine_closest_points ? model_.grid.refined(q, found)
                                                         : model_.grid.stored(q, found);
      if (inside) pairs_.push_back({q, found.point, found.normal, (found.point - q).squaredNorm()});
    }
    adapt_gate();
    const double limit = gate_ * gate_;
    near_ = 0;
    for (const Pair& p : pairs_) {
      if (p.squared_distance <= limit || !is_behind(p, to_model.position)) ++near_;
    }
    pairs_.erase(std::remove_if(pairs_.begin(), pairs_.end(),
                                [&](const Pair& p) { return p.squared_distance > limit; }),
                 pairs_.end());
  }

  const std::vector<Pair>& pairs() const { return pairs_; }
  int near() const { return near_; }

 private:
  /// Whether a return lies behind the model along its beam, as of a mount: not an outlier of the
  /// target.
  static bool is_behind(const Pair& p, const Vector3d& eye) {
    constexpr double min_cosine = 0.3;
    const Vector3d beam = p.data - eye;
    const Vector3d from_model = p.data - p.model;
    return from_model.dot(beam) > min_cosine * from_model.norm() * beam.norm();
  }

  /// The gate follows the robust scatter of its pairs: it shrinks as the fit improves.
  void adapt_gate() {
    const double limit = gate_ * gate_;
    distances_.clear();
    for (const Pair& p : pairs_) {
      if (p.squared_distance <= limit) distances_.push_back(p.squared_distance);
    }
    if (distances_.empty()) return;
    constexpr double sigma_of_median = 1.4826;
    gate_ = std::clamp(options_.gate_sigmas * sigma_of_median * std::sqrt(upper_median(distances_)),
                       options_.min_gate_m, options_.start_gate_m);
  }

  const TargetModel& model_;
  const std::vector<Vector3d>& points_;
  const IcpOptions& options_;
  double gate_;
  int near_ = 0;
  std::vector<Pair> pairs_;
  std::vector<double> distances_;
};

}  // namespace

IcpResult align(const TargetModel& model, const std::vector<Vector3d>& points, const Pose& start,
                const IcpOptions& options) {
  constexpr std::size_t min_pairs = 6;
  IcpResult result;
  result.pose = start;
  Matcher matcher(model, points, options);
  Accelerator accelerator(model.canonical.half_length);
  matcher.match(result.pose);
  for (int i = 0; i < options.max_iterations && matcher.pairs().size() >= min_pairs; ++i) {
    ++result.iterations;
    // The motion is of the data in the model frame; the model moves inversely.
    const bool points_only = options.registration == Registration::point_to_point;
    const Pose motion =
        points_only ? register_points(matcher.pairs()) : register_planes(matcher.pairs());
    const Pose applied = points_only ? accelerator.extrapolated(motion) : motion;
    result.pose = result.pose * applied.inverse();
    matcher.match(result.pose);
    const Vector6d step = difference(Pose{}, motion);
    // A turn about the far origin also shifts: judge the shift at the model's centre.
    const double shift = (motion * model.centre - model.centre).norm();
    if (shift < options.stop_translation_m && step.tail<3>().norm() < options.stop_rotation_rad) {
      result.converged = true;
      break;
    }
  }

  result.near = matcher.near();
  result.used = static_cast<int>(matcher.pairs().size());
  double sum = 0;
  const Matrix3d rotation = result.pose.rotation.toRotationMatrix();
  for (const Pair& p : matcher.pairs()) {
    const double along_normal = p.normal.dot(p.model - p.data);
    sum += along_normal * along_normal;
    const Vector3d normal = rotation * p.normal;
    const Vector3d arm = rotation * p.model;
    Vector6d j;
    j << normal, arm.cross(normal);
    result.information.noalias() += j * j.transpose();
  }
  if (result.used > 0) result.residual_rms = std::sqrt(sum / result.used);
  if (result.used >= static_cast<int>(min_pairs)) {
    // In units in which a radian counts as the model's half length, so that eigenvalues compare.
    // The weakest direction must be determined to a hundredth of the target's length.
    Vector6d scale;
    scale << 1, 1, 1, Vector3d::Constant(1 / model.canonical.half_length);
    const Matrix6d scaled = scale.asDiagonal() * result.information * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaled, Eigen::EigenvaluesOnly);
    constexpr double min_sigma = 0.005;
    const double sigma = std::max(result.residual_rms, min_sigma);
    const double needed = 0.02 * model.canonical.half_length;
    result.constrained = eigen.eigenvalues()[0] * needed * needed > sigma * sigma;
  }
  return result;
}

std::string IcpTracking::name() const {
  return options_.icp.registration == Registration::point_to_point ? "icp point_to_point"
                                                                   : "icp point_to_plane";
}

std::vector<Vector3d> IcpTracking::points_of(const PreprocessedScan& still) const {
  const std::size_t stride = 1 + still.points.size() / (options_.max_points + 1);
  std::vector<Vector3d> points;
  points.reserve(still.points.size() / stride + 1);
  for (std::size_t i = 0; i < still.points.size(); i += stride) points.push_back(still.points[i]);
  return points;
}

std::string IcpTracking::judge(const TrackingResult& result, const IcpResult& icp,
                               const Likelihood& fit, const Pose& predicted) const {
  if (icp.used < options_.min_used) {
    return std::to_string(icp.used) + " returns fit the target, at least " +
           std::to_string(options_.min_used) + " are needed";
  }
  if (!icp.constrained) return "the returns do not determine all six degrees of freedom";
  if (icp.inlier_share() < options_.min_inlier_share) {
    return "only " + fixed(100 * icp.inlier_share(), 0) +
           " % of the returns about the target fit it";
  }
  if (icp.residual_rms > options_.max_residual_m) {
    return "residual " + fixed(1e3 * icp.residual_rms, 1) + " mm, at most " +
           fixed(1e3 * options_.max_residual_m, 1) + " mm is trusted";
  }
  const std::string far = prediction_mismatch(model_, predicted, result.pose, options_.max_shift_m,
                                              options_.max_turn_rad);
  if (!far.empty()) return far;
  const double predicted_beams = std::max(1, fit.predicted);
  if (fit.explained < options_.min_explained * predicted_beams) {
    return "only " + fixed(100 * fit.explained / predicted_beams, 0) +
           " % of the beams that should meet the target return from it";
  }
  if (fit.through > options_.max_through * predicted_beams) {
    return fixed(100 * fit.through / predicted_beams, 0) +
           " % of the beams that should meet the target go through it";
  }
  return "";
}

TrackingResult IcpTracking::track(const PreprocessedScan& skewed,
                                  const Prediction& predicted) const {
  const PreprocessedScan scan =
      options_.deskew ? at_mean_time(skewed, predicted.velocity, predicted.pose.position) : skewed;
  TrackingResult result;
  const IcpResult icp = align(model_, points_of(scan), predicted.pose, options_.icp);
  result.pose = icp.pose;
  result.residual_rms = icp.residual_rms;
  result.iterations = icp.iterations;
  result.used = icp.used;
  result.near = icp.near;
  constexpr std::size_t max_beams = 4000;
  for (int i = 0; i < options_.beam_steps; ++i) {
    const BeamStep refined =
        beam_step(model_, scan.beams, result.pose, options_.icp.min_gate_m, max_beams);
    result.pose = perturbed(result.pose, refined.step);
  }

  constexpr std::size_t beams_checked = 300;
  const std::size_t stride = std::max<std::size_t>(1, scan.beams.size() / beams_checked);
  const Likelihood fit =
      beam_likelihood(model_, beam_model_, scan.beams, result.pose, stride, options_.likelihood);
  result.confidence = icp.inlier_share() * fit.explained / std::max(1, fit.predicted);

  // Distances to closest points underestimate the noise: a return displaced through a panel is
  // close to its other side. Range residuals do not; the step that they still suggest is a
  // systematic error.
  const BeamStep against =
      beam_step(model_, scan.beams, result.pose, 3 * options_.icp.min_gate_m, max_beams);
  const double sigma = std::max({icp.residual_rms, against.sigma, beam_model_.range_sigma_m});
  // Unobservable directions are bounded by the prediction's covariance, at three sigma.
  const Matrix6d bound = (9 * predicted.covariance).ldlt().solve(Matrix6d::Identity());
  const Matrix6d information =
      icp.information / (options_.covariance_scale * sigma * sigma) + bound;
  result.covariance = information.ldlt().solve(Matrix6d::Identity());
  result.covariance = Matrix6d(0.5 * (result.covariance + result.covariance.transpose()));
  result.covariance += against.step * against.step.transpose();
  result.covariance.diagonal().head<3>().array() += options_.floor_m * options_.floor_m;
  result.covariance.diagonal().tail<3>().array() += options_.floor_rad * options_.floor_rad;

  result.reason = judge(result, icp, fit, predicted.pose);
  result.ok = result.reason.empty();
  return result;
}

}  // namespace berth::estimator
