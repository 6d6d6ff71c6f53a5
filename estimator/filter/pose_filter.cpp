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
  probable_ = 0;
  utime_ = utime;
  motion_ = {pose, velocity};
  Matrix12d p = Matrix12d::Zero();
  p.topLeftCorner<6, 6>() = covariance;
  p.bottomRightCorner<6, 6>() = velocity_covariance;
  with_considered_.setZero();
  set_covariance(p);
}

Pose PoseFilter::predict(std::int64_t utime) const {
  return moved_on(motion_, elapsed(utime_, utime)).pose;
}

Matrix12d PoseFilter::covariance_at(std::int64_t utime) const {
  const double dt = elapsed(utime_, utime);
  const Matrix12d f = transition(motion_.velocity, dt);
  Matrix12d p = f * covariance_ * f.transpose();
  // What happened between is as unknown backwards as forwards.
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
  if (!with_considered_.isZero(0)) {
    with_considered_ =
        (transition(motion_.velocity, elapsed(utime_, utime)) * with_considered_).eval();
  }
  motion_ = moved_on(motion_, elapsed(utime_, utime));
  set_covariance(p);
  utime_ = utime;
}

Matrix6d PoseFilter::predicted_velocity_covariance(std::int64_t utime) const {
  return covariance_at(utime).bottomRightCorner<6, 6>();
}

/// A measurement that is improbable by its own word is trusted only so far that it is not; but one
/// after several probable ones only, or a target that has started to move would not be followed.
/// @return the factor on its covariance.
double PoseFilter::doubt(const Pose& measured, const Matrix6d& covariance, std::int64_t utime) {
  constexpr int needed_to_doubt = 3;
  const Vector6d surprise = berth::difference(predict(utime), measured);
  const Matrix6d expected = predicted_covariance(utime) + covariance;
  const double squared_sigmas = surprise.dot(expected.ldlt().solve(surprise));
  const double limit = options_.surprise_sigmas * options_.surprise_sigmas;
  const bool improbable = squared_sigmas > limit;
  const double factor = improbable && probable_ >= needed_to_doubt ? squared_sigmas / limit : 1;
  probable_ = improbable ? 0 : probable_ + 1;
  return factor;
}

/// Does the update, or, where that returns false, leaves the filter as it was.
template <class Update>
bool PoseFilter::or_unchanged(Update update) {
  const PoseFilter before = *this;
  const bool done = update();
  if (!done) *this = before;
  return done;
}

/// @param returns linearises what is measured about a motion at its own time, which may be before
/// the filter's. @return false, half done, when the filter's covariance or the information is not
/// positive or not finite.
template <class Source>
bool PoseFilter::take_in(const Source& returns, std::int64_t utime) {
  constexpr int iterations = 3;  // each linearised about the last one's result
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
    // From the prior's mean, which lies d away from where the batch was linearised.
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
  with_considered_ = (with_considered_ - covariance_ * last * with_considered_).eval();
  return true;
}

bool PoseFilter::update(const Pose& measured, const Matrix6d& covariance, std::int64_t utime) {
  const std::int64_t when = std::max(utime, utime_);
  const Pose now = moved(measured, motion_.velocity, elapsed(utime, when));
  if (!difference(motion_, {now, {}}).allFinite() || !is_covariance(covariance)) return false;
  return or_unchanged([&] {
    const Matrix6d weight =
        (doubt(now, covariance, when) * covariance).ldlt().solve(Matrix6d::Identity());
    MotionInformation linear;
    linear.information.topLeftCorner<6, 6>() = weight;
    return take_in(
        [&](const Motion& about) {
          linear.gradient.head<6>() = weight * berth::difference(about.pose, now);
          return linear;
        },
        when);
  });
}

bool PoseFilter::update(const Pose& measured, const Matrix6d& covariance,
                        const MeasuredMotion& motion, std::int64_t utime) {
  if (!difference(motion_, {measured, {}}).allFinite() || !is_covariance(covariance)) return false;
  return or_unchanged([&] {
    const double factor = doubt(measured, covariance, utime);
    if (!motion.systematic.isZero(0)) return take_in_considering(motion, factor, utime);
    MotionInformation said = motion.said;
    said.information /= factor;
    return take_in(
        [&](const Motion& about) {
          said.gradient =
              motion.said.gradient / factor + said.information * difference(about, motion.about);
          return said;
        },
        utime);
  });
}

/// The update by z = motion + c + noise. With the score's covariance Lambda = V + V_c, of the
/// returns' noise and of c: z has the information Lambda V^-1 Lambda, and C = Lambda^-1 V_c
/// Lambda^-1. In coordinates in which the motion's covariance is 1, where Lambda may be singular:
/// of what it does not tell, a billionth of what is known counts as told.
bool PoseFilter::take_in_considering(const MeasuredMotion& motion, double factor,
                                     std::int64_t utime) {
  constexpr double nothing = 1e-9;
  const double late = elapsed(utime, std::max(utime, utime_));
  advance(utime);
  const Eigen::LLT<Matrix12d> known(covariance_);
  if (!covariance_.allFinite() || known.info() != Eigen::Success) return false;
  const Matrix12d l = known.matrixL();
  const Matrix12d to = transition(motion_.velocity, -late) * l;
  const Matrix12d one = Matrix12d::Identity();
  const Matrix12d information = to.transpose() * motion.said.information * to / factor;
  const Matrix12d considered = to.transpose() * motion.systematic * to / factor;
  const Vector12d gradient =
      to.transpose() *
      (motion.said.gradient / factor +
       motion.said.information / factor * difference(moved_on(motion_, -late), motion.about));
  const Eigen::LLT<Matrix12d> noise(information - considered + nothing * one);
  const Eigen::LLT<Matrix12d> all(information + nothing * one);
  if (noise.info() != Eigen::Success || all.info() != Eigen::Success) return false;
  const Matrix12d told = information * noise.solve(information);
  const Matrix12d c = all.solve(all.solve(considered).transpose());
  Matrix12d spread = l * c * l.transpose();
  constexpr double exact = 1e-12;  // m^2, rad^2: of no account, but keeps c's covariance positive
  spread.diagonal().array() += exact;
  const Eigen::LLT<Matrix12d> root(spread);
  if (root.info() != Eigen::Success) return false;
  const Matrix12d s = root.matrixL();

  const Vector3d from = motion.about.pose.inverse().position.normalized();
  const double angle = std::atan2(seen_from_.cross(from).norm(), seen_from_.dot(from));
  seen_from_ = from;
  const Matrix12d kept = (1 - angle / std::numbers::pi) * with_considered_ * s.transpose();
  const Matrix12d half = known.matrixL().solve(kept);
  const Matrix12d with_c = known.matrixL().solve(Matrix12d(half.transpose())).transpose();
  const Matrix12d with_z = one + with_c;
  const Matrix12d z = with_z + with_c.transpose() + c;
  const Eigen::PartialPivLU<Matrix12d> sum(one + told * z);
  const Matrix12d gain = with_z * sum.solve(told);
  const Vector12d step = l * (with_z * sum.solve(information * noise.solve(gradient)));
  const Matrix12d posterior = l * (one - gain * with_z.transpose()) * l.transpose();
  if (!step.allFinite() || !posterior.allFinite() ||
      Eigen::LLT<Matrix12d>(posterior).info() != Eigen::Success) {
    return false;
  }
  motion_ = perturbed(motion_, step);
  const Matrix12d with_shift = l * (with_c - gain * (with_c + c)) * l.transpose();
  with_considered_ = root.matrixL().solve(Matrix12d(with_shift.transpose())).transpose();
  set_covariance(posterior);
  return true;
}

/// What the target seems to do in a frame that accelerates and turns.
void PoseFilter::accelerate(const SensorMotion& sensor, double dt) {
  const Vector3d& turn = sensor.angular_velocity;
  const Vector3d& p = motion_.pose.position;
  Velocity& v = motion_.velocity;
  const Vector3d linear = sensor.acceleration + sensor.angular_acceleration.cross(p) +
                          2 * turn.cross(v.linear) + turn.cross(turn.cross(p));
  const Vector3d angular = sensor.angular_acceleration + turn.cross(v.angular);
  v.linear -= dt * linear;
  v.angular -= dt * angular;
}

void PoseFilter::carry(const SensorMotion& sensor, std::int64_t until) {
  advance(sensor.begin);  // unknown until then
  const double dt = elapsed(utime_, std::min(until, sensor.end));
  if (!started_ || dt <= 0) return;
  accelerate(sensor, dt / 2);
  advance(std::min(until, sensor.end));
  accelerate(sensor, dt / 2);
  Matrix12d p = covariance_;
  const double share = dt / elapsed(sensor.begin, sensor.end);
  p.diagonal().segment<3>(6).array() += share * sensor.velocity_sigma * sensor.velocity_sigma;
  p.diagonal().tail<3>().array() +=
      share * sensor.angular_velocity_sigma * sensor.angular_velocity_sigma;
  set_covariance(p);
}

}  // namespace berth::estimator
