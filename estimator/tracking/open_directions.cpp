// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/open_directions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <vector>

namespace berth::estimator {

namespace {

/// The least known first; each moves the target's ends by about 1 m.
std::vector<Vector6d> open_directions(const Matrix6d& information, double radius,
                                      const OpenDirectionsOptions& options) {
  Vector6d scale;
  scale << Vector3d::Ones(), Vector3d::Constant(1 / radius);
  const Matrix6d in_metres = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(in_metres);
  const double most_known = 1 / (options.least_m * options.least_m);
  std::vector<Vector6d> directions;
  for (int i = 0; i < options.most; ++i) {
    if (i > 0 && solver.eigenvalues()[i] > most_known) break;
    directions.emplace_back(scale.asDiagonal() * solver.eigenvectors().col(i));
  }
  return directions;
}

}  // namespace

Pose along_open_directions(const Pose& start, const Matrix6d& information, double radius,
                           const std::function<double(const Pose&)>& cost,
                           const OpenDirectionsOptions& options) {
  const std::vector<Vector6d> directions = open_directions(information, radius, options);
  Pose best = start;
  double least = cost(best);
  int left = options.most_evaluations - 1;
  for (double step = options.first_m; step >= options.last_m && left > 0; step *= 0.5) {
    for (bool moved = true; moved && left > 0;) {
      moved = false;
      for (const Vector6d& direction : directions) {
        for (const double sign : {1.0, -1.0}) {
          const Pose other = perturbed(best, sign * step * direction);
          --left;
          const double its = cost(other);
          if (!(its < least)) continue;
          least = its;
          best = other;
          moved = true;
          break;
        }
      }
    }
  }
  return best;
}

}  // namespace berth::estimator
