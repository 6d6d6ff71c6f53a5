// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/cramer_rao.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace berth::benchmark {

// A beam from the origin along u meets the plane n.(x - q) = 0 at range r = n.q / n.u. When the
// pose moves by (t, w), q moves by t + w x (q - position), hence
//   dr/dt = n / n.u,   dr/dw = ((q - position) x n) / n.u.
// An error of the beam's angle turns u by a vector e across it: dr = -r (n.e) / n.u.
Matrix6d fisher_information(const Vector3d& direction, const TrueFace& face, const Pose& pose,
                            const BeamModel& noise) {
  const double facing = face.normal.dot(direction);
  if (face.range <= 0 || std::abs(facing) < 1e-3) return Matrix6d::Zero();
  const Vector3d arm = face.range * direction - pose.position;
  Vector6d jacobian;
  jacobian << face.normal, arm.cross(face.normal);
  jacobian /= facing;
  const double cosine = std::hypot(direction.x(), direction.z());  // of the elevation
  const Vector3d right(direction.z() / cosine, 0, -direction.x() / cosine);
  const Vector3d up = right.cross(direction);
  const double across = std::pow(face.normal.dot(right) * cosine * noise.azimuth_sigma_rad, 2) +
                        std::pow(face.normal.dot(up) * noise.elevation_sigma_rad, 2);
  const double variance = noise.range_sigma_m * noise.range_sigma_m +
                          face.range * face.range * across / (facing * facing);
  return jacobian * jacobian.transpose() / variance;
}

Matrix6d fisher_information(const Scan& scan, const Pose& pose, const BeamModel& noise) {
  Matrix6d information = Matrix6d::Zero();
  for (std::size_t i = 0; i < scan.beams.size(); ++i) {
    if (scan.faces[i].range <= 0) continue;
    information += fisher_information(
        beam_direction(scan.beams[i].azimuth, scan.beams[i].elevation), scan.faces[i], pose, noise);
  }
  return information;
}

Bound cramer_rao_bound(const Matrix6d& information) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(information);
  if (!(eigen.eigenvalues()[0] > 1e-9 * eigen.eigenvalues()[5])) return {};
  const Matrix6d covariance = eigen.eigenvectors() *
                              eigen.eigenvalues().cwiseInverse().asDiagonal() *
                              eigen.eigenvectors().transpose();
  return {std::sqrt(covariance.topLeftCorner<3, 3>().trace()),
          std::sqrt(covariance.bottomRightCorner<3, 3>().trace()), true};
}

}  // namespace berth::benchmark
