// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/covariance.h"

#include <Eigen/Cholesky>

namespace berth {
namespace {

constexpr double symmetric_to = 1e-6;  // of a correlation
constexpr double min_pivot = 1e-12;    // of correlations: below, rounding alone

}  // namespace

std::string covariance_defect(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  if (!matrix.allFinite()) return "is not finite";
  const Eigen::VectorXd variances = matrix.diagonal();
  if (variances.minCoeff() <= 0) return "is not positive definite";
  const Eigen::VectorXd scale = variances.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlations = scale.asDiagonal() * matrix * scale.asDiagonal();
  if ((correlations - correlations.transpose()).cwiseAbs().maxCoeff() > symmetric_to) {
    return "is not symmetric";
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(correlations);
  const bool positive = factor.info() == Eigen::Success &&
                        factor.matrixLLT().diagonal().cwiseAbs2().minCoeff() > min_pivot;
  return positive ? "" : "is not positive definite";
}

}  // namespace berth
