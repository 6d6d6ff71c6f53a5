// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/beam_registration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/core/statistics.h"

namespace berth::estimator {

Likelihood beam_likelihood(const TargetModel& model, const BeamModel& beam_model,
                           const std::vector<Beam>& beams, const Pose& pose, std::size_t stride,
                           const LikelihoodOptions& options) {
  const double log_miss_past = std::log(1 - options.background);
  const double log_hit_past = std::log(options.background / options.background_depth_m);
  const double log_drop_out = std::log(options.drop_out);
  const double outlier_density = options.outlier / options.background_depth_m;
  const double on_target = 1 - options.drop_out - options.outlier;
  const double az = beam_model.azimuth_sigma_rad;
  const double el = beam_model.elevation_sigma_rad;
  const double range_variance = beam_model.range_sigma_m * beam_model.range_sigma_m;
  const double angle_variance = 0.5 * (az * az + el * el);
  const double model_variance = options.model_sigma_m * options.model_sigma_m;
  const Pose to_model = pose.inverse();
  const Matrix3d rotation = to_model.rotation.toRotationMatrix();  // sensor to model
  const Vector3d& origin = to_model.position;                      // of the beams, model frame
  const Vector3d to_centre = model.centre - origin;
  const double far = to_centre.norm() + model.radius;
  const double squared_reach = to_centre.squaredNorm() - model.radius * model.radius;

  Likelihood sum;
  for (std::size_t i = 0; i < beams.size(); i += stride) {
    const Beam& beam = beams[i];
    const Vector3d direction = rotation * beam.direction;
    const double along = direction.dot(to_centre);
    RayHit hit;
    // A beam that passes the sphere about the model need not be cast.
    const bool may_meet = squared_reach <= 0 || (along > 0 && along * along >= squared_reach);
    if (!may_meet || !model.caster.cast({origin, direction}, far, hit)) {
      sum.log_likelihood += beam.hit() ? log_hit_past : log_miss_past;
      continue;
    }
    ++sum.predicted;
    if (!beam.hit()) {
      ++sum.through;
      sum.log_likelihood += log_drop_out;
      continue;
    }
    const double cosine = std::clamp(-direction.dot(hit.normal), 0.05, 1.0);
    const double facing = cosine * cosine;
    const double across = hit.range * hit.range * (1 - facing) * angle_variance;
    const double variance = range_variance + (across + model_variance) / facing;
    const double miss = beam.range - hit.range;
    const double density = on_target * std::exp(-0.5 * miss * miss / variance) /
                           std::sqrt(2 * radians(180.0) * variance);
    sum.log_likelihood += std::log(density + outlier_density);
    if (miss * miss < 9 * variance) {
      ++sum.explained;
    } else if (miss > 0) {
      ++sum.through;
    }
  }
  return sum;
}

BeamStep beam_step(const TargetModel& model, const std::vector<Beam>& beams, const Pose& pose,
                   double gate, std::size_t max_beams) {
  constexpr double grazing = 0.1;  // cosine of incidence below which ranges are too uncertain
  const Pose to_model = pose.inverse();
  const Matrix3d rotation = to_model.rotation.toRotationMatrix();
  const Matrix3d back = rotation.transpose();
  const double far = (model.centre - to_model.position).norm() + model.radius;
  const std::size_t stride = std::max<std::size_t>(1, beams.size() / max_beams);

  BeamStep result;
  Matrix6d a = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  std::vector<double> residuals;
  for (std::size_t i = 0; i < beams.size(); i += stride) {
    const Beam& beam = beams[i];
    if (!beam.hit()) continue;
    RayHit hit;
    const Vector3d direction = rotation * beam.direction;
    if (!model.caster.cast({to_model.position, direction}, far, hit)) continue;
    const double cosine = -direction.dot(hit.normal);
    if (cosine < grazing) continue;
    const double residual = (hit.range - beam.range) * cosine;  // along the normal
    if (std::abs(residual) > gate) continue;
    residuals.push_back(std::abs(residual));
    const Vector3d normal = back * hit.normal;
    const Vector3d arm = beam.direction * hit.range - pose.position;
    Vector6d j;
    j << normal, arm.cross(normal);
    a.noalias() += j * j.transpose();
    b += j * residual;
  }
  result.used = static_cast<int>(residuals.size());
  if (result.used < 12) return result;
  a.diagonal().array() += 1e-4 * result.used;  // regularisation of unobservable directions
  result.step = a.ldlt().solve(b);
  result.sigma = 1.4826 * upper_median(std::move(residuals));
  return result;
}

}  // namespace berth::estimator
