// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/filter/pose_filter.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "common/core/covariance.h"

namespace berth::estimator {

namespace {

/// Left Jacobian of SO(3): Exp(v + d) = Exp(J d) Exp(v) to first order.
Matrix3d left_jacobian(const Vector3d& v) {
  const double angle = v.norm();
  const Matrix3d s = skew(v);
  if (angle < 1e-5) return Matrix3d::Identity() + 0.5 * s;
  const double square = angle * angle;
  return Matrix3d::Identity() + (1 - std::cos(angle)) / square * s +
         (angle - std::sin(angle)) / (square * angle) * s * s;
}

Motion moved_on(const Motion& motion, double dt) {
  return {moved(motion.pose, motion.velocity, dt), motion.velocity};
}

/// d motion(t + dt) / d motion(t).
Matrix12d transition(const Velocity& velocity, double dt) {
  const Vector3d turn = velocity.angular * dt;
  Matrix12d f = Matrix12d::Identity();
  f.block<3, 3>(0, 6).diagonal().setConstant(dt);
  f.block<3, 3>(3, 3) = rotation_from_vector(turn).toRotationMatrix();
  f.block<3, 3>(3, 9) = dt * left_jacobian(turn);
  return f;
}

}  // namespace

void PoseFilter::set_covariance(const Matrix12d& covariance) {
  covariance_ = 0.5 * (covariance + covariance.transpose());
  pose_covariance_ = covariance_.topLeftCorner<6, 6>();
  velocity_covariance_ = covariance_.bottomRightCorner<6, 6>();
}

void PoseFilter::start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime) {
  Vector6d v;
  v << Vector3d::Constant(options_.unknown_speed * options_.unknown_speed),
      Vector3d::Constant(options_.unknown_rotation * options_.unknown_rotation);
  start(pose, covariance, utime, {}, v.asDiagonal());
}

void PoseFilter::start(const Pose& pose, const Matrix6d& covariance, std::int64_t utime,
                       const Velocity& velocity, const Matrix6d& velocity_covariance) {
  started_ = true;
  consistent_ = 0;
  utime_ = utime;
  motion_ = {pose, velocity};
  Matrix12d p = Matrix12d::Zero();
  p.topLeftCorner<6, 6>() = covariance;
  p.bottomRightCorner<6, 6>() = velocity_covariance;
  consider_cross_.setZero();
  set_covariance(p);
}

Pose PoseFilter::predict(std::int64_t utime) const {
  return moved_on(motion_, elapsed(utime_, utime)).pose;
}

Matrix12d PoseFilter::covariance_at(std::int64_t utime) const {
  const double dt = elapsed(utime_, utime);
  const Matrix12d f = transition(motion_.velocity, dt);
  Matrix12d p = f * covariance_ * f.transpose();
  // Process noise, equal backwards and forwards.
  const double t = std::abs(dt);
  Vector6d q;
  q << Vector3d::Constant(options_.linear_acceleration * options_.linear_acceleration),
      Vector3d::Constant(options_.angular_acceleration * options_.angular_acceleration);
  for (int i = 0; i < 6; ++i) {
    p(i, i) += q[i] * t * t * t / 3;
    p(i, i + 6) += q[i] * t * dt / 2;
    p(i + 6, i) += q[i] * t * dt / 2;
    p(i + 6, i + 6) += q[i] * t;
  }
  return 0.5 * (p + p.transpose());
}

Matrix6d PoseFilter::predicted_covariance(std::int64_t utime) const {
  return covariance_at(utime).topLeftCorner<6, 6>();
}

void PoseFilter::advance(std::int64_t utime) {
  if (utime <= utime_) return;
  const Matrix12d p = covariance_at(utime);
  if (!consider_cross_.isZero(0)) {
    consider_cross_ =
        (transition(motion_.velocity, elapsed(utime_, utime)) * consider_cross_).eval();
  }
  motion_ = moved_on(motion_, elapsed(utime_, utime));
  set_covariance(p);
  utime_ = utime;
}

Matrix6d PoseFilter::predicted_velocity_covariance(std::int64_t utime) const {
  return covariance_at(utime).bottomRightCorner<6, 6>();
}

/// Covariance inflation of a measurement outside the innovation gate, so that it lies on the gate.
/// Only after several measurements inside: else a target that has started to move would not be
/// followed.
/// @return the factor on the measurement's covariance.
double PoseFilter::inflation(const Pose& measured, const Matrix6d& covariance, std::int64_t utime) {
  constexpr int min_consistent = 3;
  const Vector6d innovation = berth::difference(predict(utime), measured);
  const Matrix6d expected = predicted_covariance(utime) + covariance;
  const double squared_sigmas = innovation.dot(expected.ldlt().solve(innovation));
  const double limit = options_.surprise_sigmas * options_.surprise_sigmas;
  const bool improbable = squared_sigmas > limit;
  const double factor = improbable && consistent_ >= min_consistent ? squared_sigmas / limit : 1;
  consistent_ = improbable ? 0 : consistent_ + 1;
  return factor;
}

/// Runs the update; where that returns false, restores the state before it.
template <class Update>
bool PoseFilter::or_restore(Update update) {
  const PoseFilter before = *this;
  const bool done = update();
  if (!done) *this = before;
  return done;
}

/// Iterated Kalman update.
/// @param returns linearises the measurement about a motion at its own time, which may be before
/// the filter's
/// @return false, with the update half done, when the filter's covariance or the information is not
/// positive or not finite.
template <class Source>
bool PoseFilter::iterated_update(const Source& returns, std::int64_t utime) {
  constexpr int iterations = 3;  // each linearised about the last result
  const double late = elapsed(utime, std::max(utime, utime_));
  advance(utime);
  const Eigen::LLT<Matrix12d> factor(covariance_);
  if (!covariance_.allFinite() || factor.info() != Eigen::Success) return false;
  const Matrix12d l = factor.matrixL();
  const Motion prior = motion_;
  Matrix12d last = Matrix12d::Zero();
  for (int i = 0; i < iterations; ++i) {
    MotionInformation batch = returns(moved_on(motion_, -late));
    if (late > 0) {
      const Matrix12d back = transition(motion_.velocity, -late);
      batch.information = (back.transpose() * batch.information * back).eval();
      batch.gradient = (back.transpose() * batch.gradient).eval();
    }
    const Matrix12d inner = Matrix12d::Identity() + l.transpose() * batch.information * l;
    const Eigen::LLT<Matrix12d> posterior(inner);
    if (!inner.allFinite() || posterior.info() != Eigen::Success) return false;
    // From the prior's mean, at d from the linearisation point.
    const Vector12d d = difference(motion_, prior);
    const Vector12d step =
        d + l * posterior.solve(l.transpose() * (batch.gradient - batch.information * d));
    if (!step.allFinite()) return false;
    motion_ = perturbed(motion_, step);
    const Matrix12d root = posterior.matrixL().solve(Matrix12d(l.transpose()));
    set_covariance(root.transpose() * root);
    last = batch.information;
    constexpr double small = 1e-7;  // m, rad
    if (step.head<6>().norm() < small) break;
  }
  consider_cross_ = (consider_cross_ - covariance_ * last * consider_cross_).eval();
  return true;
}

bool PoseFilter::update(const Pose& measured, const Matrix6d& covariance, std::int64_t utime) {
  const std::int64_t when = std::max(utime, utime_);
  const Pose now = moved(measured, motion_.velocity, elapsed(utime, when));
  if (!difference(motion_, {now, {}}).allFinite() || !is_covariance(covariance)) return false;
  return or_restore([&] {
    const Matrix6d weight =
        (inflation(now, covariance, when) * covariance).ldlt().solve(Matrix6d::Identity());
    MotionInformation linear;
    linear.information.topLeftCorner<6, 6>() = weight;
    return iterated_update(
        [&](const Motion& at) {
          linear.gradient.head<6>() = weight * berth::difference(at.pose, now);
          return linear;
        },
        when);
  });
}

bool PoseFilter::update(const Pose& measured, const Matrix6d& covariance,
                        const MeasuredMotion& motion, std::int64_t utime) {
  if (!difference(motion_, {measured, {}}).allFinite() || !is_covariance(covariance)) return false;
  return or_restore([&] {
    const double factor = inflation(measured, covariance, utime);
    if (!motion.systematic.isZero(0)) return schmidt_update(motion, factor, utime);
    MotionInformation measurement = motion.measurement;
    measurement.information /= factor;
    return iterated_update(
        [&](const Motion& at) {
          measurement.gradient = motion.measurement.gradient / factor +
                                 measurement.information * difference(at, motion.reference);
          return measurement;
        },
        utime);
  });
}

/// Schmidt-Kalman update by z = motion + c + noise. With the score's covariance Lambda = V + V_c,
/// of the returns' noise and of c, z has the information Lambda V^-1 Lambda, and C = Lambda^-1 V_c
/// Lambda^-1. Computed in coordinates in which the motion's covariance is 1, with a ridge of 1e-9
/// of the prior information where Lambda is singular.
bool PoseFilter::schmidt_update(const MeasuredMotion& motion, double factor, std::int64_t utime) {
  constexpr double ridge = 1e-9;
  const double late = elapsed(utime, std::max(utime, utime_));
  advance(utime);
  const Eigen::LLT<Matrix12d> prior_factor(covariance_);
  if (!covariance_.allFinite() || prior_factor.info() != Eigen::Success) return false;
  const Matrix12d l = prior_factor.matrixL();
  const Matrix12d to = transition(motion_.velocity, -late) * l;
  const Matrix12d one = Matrix12d::Identity();
  const Matrix12d information = to.transpose() * motion.measurement.information * to / factor;
  const Matrix12d considered = to.transpose() * motion.systematic * to / factor;
  const Vector12d gradient =
      to.transpose() * (motion.measurement.gradient / factor +
                        motion.measurement.information / factor *
                            difference(moved_on(motion_, -late), motion.reference));
  const Eigen::LLT<Matrix12d> noise(information - considered + ridge * one);
  const Eigen::LLT<Matrix12d> all(information + ridge * one);
  if (noise.info() != Eigen::Success || all.info() != Eigen::Success) return false;
  const Matrix12d z_information = information * noise.solve(information);
  const Matrix12d c = all.solve(all.solve(considered).transpose());
  Matrix12d spread = l * c * l.transpose();
  constexpr double exact = 1e-12;  // m^2, rad^2: negligible, keeps c's covariance positive
  spread.diagonal().array() += exact;
  const Eigen::LLT<Matrix12d> root(spread);
  if (root.info() != Eigen::Success) return false;
  const Matrix12d s = root.matrixL();

  const Vector3d from = motion.reference.pose.inverse().position.normalized();
  const double angle = std::atan2(view_direction_.cross(from).norm(), view_direction_.dot(from));
  view_direction_ = from;
  const Matrix12d decayed = (1 - angle / std::numbers::pi) * consider_cross_ * s.transpose();
  const Matrix12d half = prior_factor.matrixL().solve(decayed);
  const Matrix12d with_c = prior_factor.matrixL().solve(Matrix12d(half.transpose())).transpose();
  const Matrix12d with_z = one + with_c;
  const Matrix12d z = with_z + with_c.transpose() + c;
  const Eigen::PartialPivLU<Matrix12d> sum(one + z_information * z);
  const Matrix12d gain = with_z * sum.solve(z_information);
  const Vector12d step = l * (with_z * sum.solve(information * noise.solve(gradient)));
  const Matrix12d posterior = l * (one - gain * with_z.transpose()) * l.transpose();
  if (!step.allFinite() || !posterior.allFinite() ||
      Eigen::LLT<Matrix12d>(posterior).info() != Eigen::Success) {
    return false;
  }
  motion_ = perturbed(motion_, step);
  const Matrix12d with_shift = l * (with_c - gain * (with_c + c)) * l.transpose();
  consider_cross_ = root.matrixL().solve(Matrix12d(with_shift.transpose())).transpose();
  set_covariance(posterior);
  return true;
}

/// Apparent acceleration of the target in the accelerating, rotating sensor frame.
void PoseFilter::apply_sensor_acceleration(const SensorMotion& sensor, double dt) {
  const Vector3d& turn = sensor.angular_velocity;
  const Vector3d& p = motion_.pose.position;
  Velocity& v = motion_.velocity;
  const Vector3d linear = sensor.acceleration + sensor.angular_acceleration.cross(p) +
                          2 * turn.cross(v.linear) + turn.cross(turn.cross(p));
  const Vector3d angular = sensor.angular_acceleration + turn.cross(v.angular);
  v.linear -= dt * linear;
  v.angular -= dt * angular;
}

void PoseFilter::propagate(const SensorMotion& sensor, std::int64_t until) {
  advance(sensor.begin);  // without sensor motion until then
  const double dt = elapsed(utime_, std::min(until, sensor.end));
  if (!started_ || dt <= 0) return;
  apply_sensor_acceleration(sensor, dt / 2);
  advance(std::min(until, sensor.end));
  apply_sensor_acceleration(sensor, dt / 2);
  Matrix12d p = covariance_;
  const double share = dt / elapsed(sensor.begin, sensor.end);
  p.diagonal().segment<3>(6).array() += share * sensor.velocity_sigma * sensor.velocity_sigma;
  p.diagonal().tail<3>().array() +=
      share * sensor.angular_velocity_sigma * sensor.angular_velocity_sigma;
  set_covariance(p);
}

}  // namespace berth::estimator
