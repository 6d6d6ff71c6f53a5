// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/smooth_field.h"

#include <cmath>

namespace berth {

SmoothField::SmoothField(Random random, double length) {
  for (Feature& f : features_) {
    f.frequency = random.normal_vector(1 / length);
    f.phase = random.uniform(0, radians(360));
    f.amplitude = random.normal_vector(std::sqrt(2.0 / count));
  }
}

Vector3d SmoothField::at(const Vector3d& x) const {
  Vector3d sum = Vector3d::Zero();
  for (const Feature& f : features_) sum += std::cos(f.frequency.dot(x) + f.phase) * f.amplitude;
  return sum;
}

}  // namespace berth
