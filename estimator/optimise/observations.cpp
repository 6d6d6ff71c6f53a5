// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/optimise/observations.h"

namespace berth::estimator {

Observations::Observations(Eigen::Index state_size, std::size_t max_count)
    : jacobian_(state_size, static_cast<Eigen::Index>(max_count)) {
  observations_.reserve(max_count);
}

Eigen::MatrixXd::ColXpr Observations::add(const Observation& observation) {
  auto j = jacobian_.col(static_cast<Eigen::Index>(observations_.size()));
  j.setZero();
  observations_.push_back(observation);
  return j;
}

NormalEquations Observations::sums(const std::vector<double>& piece_weights,
                                   Eigen::Index patches) const {
  const auto n = static_cast<Eigen::Index>(observations_.size());
  const Eigen::Index size = jacobian_.rows();
  NormalEquations sums;
  sums.patch_information = Eigen::VectorXd::Zero(patches);
  sums.patch_gradient = Eigen::VectorXd::Zero(patches);
  Eigen::MatrixXd coupling = Eigen::MatrixXd::Zero(size, patches);
  Eigen::VectorXd weights(n);
  Eigen::VectorXd residuals(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Observation& o = observations_[static_cast<std::size_t>(k)];
    const double share = o.piece < 0 ? 1.0 : piece_weights[static_cast<std::size_t>(o.piece)];
    const double w = o.weight * share;
    weights[k] = w;
    residuals[k] = o.residual;
    if (o.patch < 0) continue;
    sums.patch_information[o.patch] += w * o.effect * o.effect;
    sums.patch_gradient[o.patch] += w * o.effect * o.residual;
    coupling.col(o.patch) += w * o.effect * jacobian_.col(k);
  }
  sums.coupling = coupling.transpose();
  const Eigen::MatrixXd weighted = jacobian_.leftCols(n) * weights.asDiagonal();
  sums.information = weighted * jacobian_.leftCols(n).transpose();
  sums.gradient = weighted * residuals;
  return sums;
}

}  // namespace berth::estimator
