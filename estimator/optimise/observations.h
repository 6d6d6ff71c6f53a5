// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace berth::estimator {

/// Weighted least squares of observations e = J x + a delta + noise, with J of D columns and one
/// offset delta for each of n patches: sums of them.
struct NormalEquations {
  Eigen::MatrixXd information;        ///< D x D: sum w J J'
  Eigen::VectorXd gradient;           ///< D: sum w J e
  Eigen::VectorXd patch_information;  ///< n: N = sum w a^2
  Eigen::VectorXd patch_gradient;     ///< n: g = sum w a e
  Eigen::MatrixXd coupling;           ///< n x D: H = sum w a J'
};

/// One of them, but for J.
struct Observation {
  double weight = 0;
  double residual = 0;  ///< e, at zero offset
  double effect = 0;    ///< a
  int patch = -1;       ///< negative: no patch displaces it
  int piece = -1;       ///< of a share that is not known yet; negative: none
};

/// Observations as they come, and their sums.
class Observations {
 public:
  Observations(Eigen::Index state_size, std::size_t max_count);
  /// The column J of the new observation, zero: to be filled. Valid until the next.
  Eigen::MatrixXd::ColXpr add(const Observation& observation);
  /// @param piece_weights on the weights of each piece's observations
  NormalEquations sums(const std::vector<double>& piece_weights, Eigen::Index patches) const;

 private:
  Eigen::MatrixXd jacobian_;  // a column an observation
  std::vector<Observation> observations_;
};

}  // namespace berth::estimator
