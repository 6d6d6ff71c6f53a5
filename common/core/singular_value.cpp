// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/singular_value.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace berth {

double min_singular_value(const Matrix6d& jacobian) {
  const Matrix6d square = jacobian * jacobian.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(square, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()(0)));
}

}  // namespace berth
