// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/beam_polish.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "estimator/tracking/beam_information.h"

namespace berth::estimator {

ClosePass close_pass(const TargetModel& model, const Pose& pose, const Vector3d& direction) {
  const Pose to_model = pose.inverse();
  const Vector3d ray = to_model.rotation * direction;
  const double length = model.target.length;
  const double middle = (model.centre - to_model.position).dot(ray);
  int least = DistanceTable::most;
  ClosePass pass{0, middle};
  const double step = 0.02 * length;
  const int steps = static_cast<int>(std::ceil(2 * model.radius / step));
  for (int i = 0; i < steps; ++i) {
    const double range = middle - model.radius + i * step;
    const int value = model.distances.value((to_model.position + range * ray).cast<float>());
    if (value >= least) continue;
    least = value;
    pass.range = range;
  }
  pass.distance = least * model.distances.cut_off() / DistanceTable::most / length;
  return pass;
}

BeamModel noisier(BeamModel model, double scale) {
  model.range_sigma_m *= scale;
  model.azimuth_sigma_rad *= scale;
  model.elevation_sigma_rad *= scale;
  return model;
}

Pose polished(const TargetModel& model, const BeamModel& beam_model,
              const LikelihoodOptions& likelihood, std::span<const Beam> beams,
              std::span<const std::uint32_t> picks, const Pose& start,
              const PolishOptions& options) {
  const double length = model.target.length;
  const BeamModel noise = noisier(beam_model, likelihood.noise_scale);
  BeamInformationOptions how;
  how.of_velocity = false;
  how.model_sigma_m = likelihood.model_sigma_m;
  how.likelihood = likelihood;
  how.pull_m = 0.05 * length;
  constexpr double beside = 0.06;  // of the length: beams that pass farther off say nothing
  std::vector<std::uint32_t> near;
  const Pose to_model = start.inverse();
  for (const std::uint32_t i : picks) {
    const Vector3d direction = to_model.rotation * beams[i].direction;
    if (model.distances.may_come_near({to_model.position, direction}, beside * length)) {
      near.push_back(i);
    }
  }
  const double reach = 0.03 * length;  // of a step, where beams hold nothing
  Matrix6d held = Matrix6d::Zero();
  held.diagonal() << Vector3d::Constant(1 / (reach * reach)),
      Vector3d::Constant(model.radius * model.radius / (reach * reach));
  BeamLinearisation at;
  at.pose = start;
  for (int i = 0; i < options.steps; ++i) {
    const double done = options.steps > 1 ? static_cast<double>(i) / (options.steps - 1) : 1;
    const double blur =
        length * options.first_blur * std::pow(options.last_blur / options.first_blur, done);
    how.pull_sigma_m = 2 * i < options.steps ? options.pull_sigma * length : 0;
    at.covariance.diagonal() << Vector3d::Constant(blur * blur),
        Vector3d::Constant(blur * blur / (model.radius * model.radius));
    const BeamInformation sums = beam_information(model, noise, beams, at, how, near);
    at.pose = perturbed(at.pose, (sums.information[0] + held).ldlt().solve(sums.gradient[0]));
  }
  return at.pose;
}

}  // namespace berth::estimator
