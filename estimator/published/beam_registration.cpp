// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/beam_registration.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace berth::estimator {

BeamStep beam_step(const TargetModel& model, const std::vector<Beam>& beams, const Pose& pose,
                   double gate, std::size_t max_beams) {
  constexpr double grazing = 0.1;  // cosine: below it a range says little of the surface
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
  a.diagonal().array() += 1e-4 * result.used;  // what no surface holds stays where it is
  result.step = a.ldlt().solve(b);
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  result.sigma = 1.4826 * *middle;
  return result;
}

}  // namespace berth::estimator
