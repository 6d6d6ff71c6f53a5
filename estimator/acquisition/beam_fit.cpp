// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/beam_fit.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "estimator/model/normal_sums.h"

namespace berth::estimator {

Pose moved_about_centre(const TargetModel& model, const Pose& pose, const Vector6d& d) {
  const Vector3d centre = pose * model.centre;
  const Quaterniond turn = rotation_from_vector(d.tail<3>());
  return {centre + d.head<3>() + turn * (pose.position - centre),
          (turn * pose.rotation).normalized()};
}

BeamFit fit_beams(const TargetModel& model, const BeamModel& beam_model,
                  std::span<const Beam> beams, const Pose& start, double first_gate,
                  double last_gate, int iterations) {
  constexpr double grazing = 0.1;  // cosine: below it a range says little of the surface
  const double az = beam_model.azimuth_sigma_rad;
  const double el = beam_model.elevation_sigma_rad;
  const double angle_variance = 0.5 * (az * az + el * el);
  const double range_variance = beam_model.range_sigma_m * beam_model.range_sigma_m;
  BeamFit fit;
  fit.pose = start;
  for (int i = 0; i < iterations; ++i) {
    const double share = iterations > 1 ? static_cast<double>(i) / (iterations - 1) : 1;
    const double gate = first_gate * std::pow(last_gate / first_gate, share);
    const Pose to_model = fit.pose.inverse();
    const Matrix3d rotation = to_model.rotation.toRotationMatrix();
    const double far = (model.centre - to_model.position).norm() + model.radius;
    NormalSums sums(false);
    fit.used = 0;
    // All in the model frame; the step is turned to sensor axes at the end.
    for (const Beam& beam : beams) {
      const Vector3d direction = rotation * beam.direction;
      const Vector3d point = to_model.position + beam.range * direction;
      Vector3d normal;
      double residual = 0;  // how far the model has to move along the normal
      double variance = 0;
      RayHit hit;
      bool met = model.caster.cast({to_model.position, direction}, far, hit);
      if (met) {
        const double cosine = -direction.dot(hit.normal);
        normal = hit.normal;
        residual = (hit.range - beam.range) * cosine;
        variance = cosine * cosine * range_variance +
                   hit.range * hit.range * (1 - cosine * cosine) * angle_variance;
        met = cosine > grazing && std::abs(residual) < 2 * gate;
      }
      if (!met) {
        ClosestPointGrid::Match match;
        if (!model.grid.refined(point, match)) continue;
        const Vector3d off = point - match.point;
        residual = off.norm();
        if (residual > 2 * gate || residual < 1e-9) continue;
        normal = off / residual;
        variance = range_variance;
      }
      const double ratio = residual / gate;
      const double robust = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
      const double weight = robust / std::max(variance, 1e-8);
      sums.add(normal, (point - model.centre).cross(normal), weight, weight * residual, 0);
      ++fit.used;
    }
    if (fit.used < 6) return fit;
    sums.flush();
    Matrix6d a = sums.products(0);
    const double strength = a.diagonal().head<3>().sum();
    fit.information = a;
    // What no surface holds stays where it is.
    a.diagonal().head<3>().array() += 1e-4 * strength;
    a.diagonal().tail<3>().array() += 1e-4 * strength * model.radius * model.radius * 0.1;
    const Vector6d step = a.ldlt().solve(sums.residuals(0));
    Matrix6d turn = Matrix6d::Zero();
    turn.topLeftCorner<3, 3>() = rotation.transpose();
    turn.bottomRightCorner<3, 3>() = rotation.transpose();
    fit.information = turn * fit.information * turn.transpose();
    fit.pose = moved_about_centre(model, fit.pose, turn * step);
  }
  return fit;
}

}  // namespace berth::estimator
