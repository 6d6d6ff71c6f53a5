// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/image_regions.h"

#include <Eigen/Eigenvalues>

namespace berth::estimator {

FittedPlane plane_through(const RangeImage& image, const std::vector<int>& beams) {
  FittedPlane plane{Vector3d::Zero(), Matrix3d::Zero()};
  for (const int b : beams) plane.mean += image.beams()[static_cast<std::size_t>(b)].point();
  plane.mean /= static_cast<double>(beams.size());
  Matrix3d scatter = Matrix3d::Zero();
  for (const int b : beams) {
    const Vector3d d = image.beams()[static_cast<std::size_t>(b)].point() - plane.mean;
    scatter += d * d.transpose();
  }
  plane.axes = Eigen::SelfAdjointEigenSolver<Matrix3d>(scatter).eigenvectors();
  return plane;
}

}  // namespace berth::estimator
