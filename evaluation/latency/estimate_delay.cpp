// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/latency/estimate_delay.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "common/core/covariance.h"
#include "common/core/text.h"

namespace berth::evaluation {
namespace {

constexpr int truths_nuisances = 21;
/// The estimator's: the weight of its prediction in the pose, and the velocity with which it
/// brought the returns to one time; of position and attitude, along each axis of the target.
constexpr int estimators_nuisances = 12;
constexpr double shrinkage_sigma = 0.5;
constexpr double skew_sigma = 0.2;  // s: scans are no longer than a second
/// Between two estimates of one track.
constexpr Utime max_step = 2 * second;
/// Slower than both a target rests, but for truth's noise.
constexpr double slowest_speed = 1e-3;          // m/s
constexpr double slowest_turn = radians(0.05);  // rad/s

struct Place : ComparedEstimate {
  std::optional<EstimateSample> before;  ///< the estimate before this scan
};

/// Estimates of the phase joined with truth at their times less the delay.
std::vector<Place> places(const Measurer& measurer, const Phase& phase, double delay) {
  std::vector<Place> list;
  std::optional<EstimateSample> last;
  for (const ComparedEstimate& c : measurer.compared()) {
    const Utime utime = c.estimate.utime;
    std::optional<EstimateSample> before = std::exchange(last, c.estimate);
    if (before && utime - before->utime > max_step) before.reset();
    if (!phase.contains(utime) || measurer.record().steered(utime)) continue;
    const auto then = compare(c.estimate, measurer.record().truth(), measurer.symmetry(),
                              utime_from_seconds(delay));
    if (then) list.push_back({*then, before});
  }
  return list;
}

/// Possible errors of truth's calibration: an offset; a rotation; both once more in the model's
/// frame; and nine coefficients of an offset in proportion to the displacement.
DelaySample::Design truths_design(const Pose& truth, const Vector3d& middle) {
  const Matrix3d turn = truth.rotation.toRotationMatrix();
  const Vector3d gone = truth.position - middle;
  DelaySample::Design x = DelaySample::Design::Zero(6, truths_nuisances);
  x.block<3, 3>(0, 0).setIdentity();
  x.block<3, 3>(3, 3).setIdentity();
  x.block<3, 3>(0, 6) = turn;
  x.block<3, 3>(3, 9) = turn;
  for (int i = 0; i < 3; ++i) x.block<3, 3>(0, 12 + 3 * i) = gone(i) * Matrix3d::Identity();
  return x;
}

/// Influence of the estimator's prior on the pose of a single scan: a share of the predicted pose,
/// and of the velocity with which it brought the returns to one time. Both lag where the target
/// accelerates, which looks like a delay. Along a face on which the pose can slide the share is
/// large, across it none: each axis of the target has its own.
void add_estimators(const Place& place, DelaySample& sample) {
  const EstimateSample& before = *place.before;
  const TruthSample& truth = place.truth;
  const double step = seconds(place.estimate.utime - before.utime);
  const Vector6d expected = difference(truth.pose, moved(before.pose, before.velocity, step));
  DelaySample::Design x = DelaySample::Design::Zero(6, truths_nuisances + estimators_nuisances);
  DelaySample::Design rates = x;
  x.leftCols(truths_nuisances) = sample.nuisances;
  Vector6d faster;
  faster << before.velocity.linear - truth.velocity.linear,
      before.velocity.angular - truth.velocity.angular;
  const Matrix3d axes = truth.pose.rotation.toRotationMatrix();
  for (const int first : {0, 3}) {  // position, attitude
    for (int i = 0; i < 3; ++i) {
      const int shrinkage = truths_nuisances + first + i;
      const Matrix3d along = axes.col(i) * axes.col(i).transpose();
      x.col(shrinkage).segment<3>(first) = along * expected.segment<3>(first);
      x.col(shrinkage + 6).segment<3>(first) = along * faster.segment<3>(first);
      rates.col(shrinkage).segment<3>(first) = along * sample.rate.segment<3>(first);
    }
  }
  sample.nuisances = x;
  sample.nuisance_rates = rates;
}

/// 1 sigma of each of them; truth's from its own covariance: an offset may be of either mount.
Eigen::VectorXd nuisance_sigma(const std::vector<Place>& places, EstimatePose which) {
  Matrix6d covariance = Matrix6d::Zero();
  for (const Place& p : places) covariance += p.truth.covariance;
  covariance /= static_cast<double>(std::max<std::size_t>(places.size(), 1));
  // A floor, so that a truth without uncertainty does not make the problem singular.
  const double position = std::sqrt(covariance.topLeftCorner<3, 3>().trace() / 3 + 1e-14);
  const double rotation = std::sqrt(covariance.bottomRightCorner<3, 3>().trace() / 3 + 1e-14);
  Eigen::VectorXd sigma = Eigen::VectorXd::Constant(truths_nuisances, rotation);
  sigma.segment<3>(0).setConstant(position);
  sigma.segment<3>(6).setConstant(position);
  sigma.head<12>() /= std::sqrt(2.0);
  if (which == EstimatePose::filtered) return sigma;
  sigma.conservativeResize(truths_nuisances + estimators_nuisances);
  sigma.tail<12>() << Vector6d::Constant(shrinkage_sigma), Vector6d::Constant(skew_sigma);
  return sigma;
}

std::vector<DelaySample> samples_of(const std::vector<Place>& places, EstimatePose which) {
  Vector3d middle = Vector3d::Zero();
  for (const Place& p : places) middle += p.truth.pose.position;
  if (!places.empty()) middle /= static_cast<double>(places.size());
  std::vector<DelaySample> samples;
  for (const Place& p : places) {
    const bool measured = which == EstimatePose::measured;
    if (measured && !p.before) continue;
    if (!is_covariance(p.estimate.covariance)) continue;
    DelaySample sample;
    sample.utime = p.estimate.utime;
    sample.error = measured ? p.measured_error() : p.error;
    sample.rate << p.truth.velocity.linear, p.truth.velocity.angular;
    sample.information = p.estimate.covariance.llt().solve(Matrix6d::Identity());
    sample.nuisances = truths_design(p.truth.pose, middle);
    if (measured) add_estimators(p, sample);
    samples.push_back(sample);
  }
  return samples;
}

/// The reason why it is not observable, and the motion needed.
std::string why_not(const EstimateDelay& d) {
  if (d.fit.samples < DelayFit::min_samples) {
    return "not observable: fewer than five estimates that truth brackets while the arms were not "
           "steered by them";
  }
  if (d.fit.half_width <= widest_delay_interval) return "";
  std::string text = "not observable: needs motion";
  // The interval narrows as the speed grows.
  const double more = d.fit.half_width / widest_delay_interval;
  const auto faster = [more](double rate, double unit, const char* name) {
    return " of " + fixed(std::ceil(rate / unit * more), 0) + " " + name + " or more (there was " +
           fixed(rate / unit, 1) + ")";
  };
  if (!std::isfinite(more)) return text + ", the target rests";
  text += d.speed > slowest_speed ? faster(d.speed, 1e-3, "mm/s")
                                  : faster(d.angular_speed, radians(1.0), "deg/s");
  return text + "; reciprocating motion is the most informative";
}

}  // namespace

EstimateDelay estimate_delay(const Measurer& measurer, const Phase& phase, EstimatePose which) {
  const std::vector<Place> stamped = places(measurer, phase, 0);
  DelayProblem problem;
  problem.nuisance_sigma = nuisance_sigma(stamped, which);
  problem.samples = [&](double delay) {
    return samples_of(delay == 0 ? stamped : places(measurer, phase, delay), which);
  };
  EstimateDelay result;
  for (const Place& p : stamped) {
    result.speed += p.truth.velocity.linear.squaredNorm();
    result.angular_speed += p.truth.velocity.angular.squaredNorm();
  }
  const auto count = static_cast<double>(std::max<std::size_t>(stamped.size(), 1));
  result.speed = std::sqrt(result.speed / count);
  result.angular_speed = std::sqrt(result.angular_speed / count);
  if (result.speed > slowest_speed || result.angular_speed > slowest_turn) {
    result.fit = fit_delay(problem);
  } else {
    result.fit.samples = stamped.size();
  }
  result.not_observable = why_not(result);
  return result;
}

}  // namespace berth::evaluation
