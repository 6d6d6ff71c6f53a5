// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/beam_likelihood.h"

#include <algorithm>
#include <cmath>

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

}  // namespace berth::estimator
