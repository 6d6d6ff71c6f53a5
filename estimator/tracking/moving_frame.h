// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "estimator/tracking/beam_information.h"

namespace berth::estimator {

/// The sensor seen from the model as it moves.
class MovingFrame {
 public:
  explicit MovingFrame(const BeamLinearisation& at)
      : at_(at), rate_(at.velocity.angular.norm()), moves_(rate_ > 0 || speed2(at) > 0) {
    turn_ = start_ = at.pose.rotation.conjugate().toRotationMatrix();
    if (rate_ > 0) {
      const Matrix3d axis = skew(at.velocity.angular / rate_);
      sine_ = start_ * axis;
      versine_ = sine_ * axis;
    }
    eye_ = turn_ * -at.pose.position;
  }

  const Matrix3d& turn() const { return turn_; }  ///< sensor to model
  const Vector3d& eye() const { return eye_; }    ///< origin of the sensor, model frame

  bool moves() const { return moves_; }

  /// @return seconds after the reference time.
  double go_to(const Beam& beam) {
    const double time = static_cast<double>(beam.utime - at_.utime) * 1e-6;
    if (moves_) move_for(time);
    return time;
  }

 private:
  void move_for(double time) {
    if (rate_ > 0) {  // Rodrigues
      const double angle = rate_ * time;
      turn_ = start_ - std::sin(angle) * sine_ + (1 - std::cos(angle)) * versine_;
    }
    eye_ = turn_ * (-at_.pose.position - time * at_.velocity.linear);
  }
  static double speed2(const BeamLinearisation& at) { return at.velocity.linear.squaredNorm(); }

  const BeamLinearisation& at_;
  double rate_;
  bool moves_;
  Matrix3d start_;
  Matrix3d sine_ = Matrix3d::Zero();
  Matrix3d versine_ = Matrix3d::Zero();
  Matrix3d turn_;
  Vector3d eye_;
};

}  // namespace berth::estimator
