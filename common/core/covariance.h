// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>

namespace berth {

/// Why a square matrix is no covariance, as a predicate ("is not finite"); empty when it is one:
/// finite, symmetric and positive definite (Cholesky decomposition of its correlations, so that
/// units do not matter). A defective covariance must not be used.
std::string covariance_defect(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

inline bool is_covariance(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  return covariance_defect(matrix).empty();
}

}  // namespace berth
