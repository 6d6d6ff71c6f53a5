// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/beam_likelihood.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

BeamLikelihood::BeamLikelihood(const TargetModel& model, const BeamModel& beam_model,
                               const LikelihoodOptions& options, const Pose& pose)
    : model_(&model),
      model_variance_(options.model_sigma_m * options.model_sigma_m),
      log_miss_past_(std::log(1 - options.background)),
      log_hit_past_(std::log(options.background / options.background_depth_m)),
      log_drop_out_(std::log(options.drop_out)),
      outlier_density_(options.outlier / options.background_depth_m),
      on_target_(1 - options.drop_out - options.outlier) {
  const double scale = options.noise_scale * options.noise_scale;
  const double az = beam_model.azimuth_sigma_rad;
  const double el = beam_model.elevation_sigma_rad;
  range_variance_ = scale * beam_model.range_sigma_m * beam_model.range_sigma_m;
  angle_variance_ = scale * 0.5 * (az * az + el * el);
  const Pose to_model = pose.inverse();
  rotation_ = to_model.rotation.toRotationMatrix();
  origin_ = to_model.position;
  to_centre_ = model.centre - origin_;
  far_ = to_centre_.norm() + model.radius;
  squared_reach_ = to_centre_.squaredNorm() - model.radius * model.radius;
}

void BeamLikelihood::add(const Beam& beam) {
  const Vector3d direction = rotation_ * beam.direction;
  const double along = direction.dot(to_centre_);
  RayHit hit;
  // A beam that passes the sphere about the model need not be cast.
  const bool may_meet = squared_reach_ <= 0 || (along > 0 && along * along >= squared_reach_);
  if (!may_meet || !model_->caster.cast({origin_, direction}, far_, hit)) {
    ++sum_.past;
    sum_.past_returned += beam.hit() ? 1 : 0;
    sum_.log_likelihood += beam.hit() ? log_hit_past_ : log_miss_past_;
    return;
  }
  ++sum_.predicted;
  if (!beam.hit()) {
    ++sum_.through;
    ++sum_.missed;
    sum_.log_likelihood += log_drop_out_;
    return;
  }
  const double cosine = std::clamp(-direction.dot(hit.normal), 0.05, 1.0);
  const double facing = cosine * cosine;
  const double across = hit.range * hit.range * (1 - facing) * angle_variance_;
  const double variance = range_variance_ + (across + model_variance_) / facing;
  const double miss = beam.range - hit.range;
  const double density = on_target_ * std::exp(-0.5 * miss * miss / variance) /
                         std::sqrt(2 * radians(180.0) * variance);
  sum_.log_likelihood += std::log(density + outlier_density_);
  if (miss * miss < 9 * variance) {
    ++sum_.explained;
  } else if (miss > 0) {
    ++sum_.through;
  }
}

Likelihood beam_likelihood(const TargetModel& model, const BeamModel& beam_model,
                           const std::vector<Beam>& beams, const Pose& pose, std::size_t stride,
                           const LikelihoodOptions& options) {
  BeamLikelihood likelihood(model, beam_model, options, pose);
  for (std::size_t i = 0; i < beams.size(); i += stride) likelihood.add(beams[i]);
  return likelihood.sum();
}

}  // namespace berth::estimator
