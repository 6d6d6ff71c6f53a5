// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// A symmetric 6x6 matrix as a column: its upper triangle, row by row.
using PackedMatrix = Eigen::Matrix<double, 21, 1>;
PackedMatrix packed_square(const Vector6d& root);  ///< of root * root^T
PackedMatrix packed(const Matrix6d& symmetric);
Matrix6d unpacked(const PackedMatrix& matrix);

/// Candidates among which returns are distributed.
struct DesignProblem {
  /// A matrix for each possible pose of the target; column i: information of one return of
  /// candidate i.
  std::vector<Eigen::Matrix<double, 21, Eigen::Dynamic>> information;
  /// Of each candidate, the variance that its returns share over a return's own: n returns have the
  /// information of n / (1 + n correlation) independent ones. Empty: all are independent.
  Eigen::VectorXd correlation;
  Matrix6d prior = Matrix6d::Identity();  ///< information without returns: positive definite
  double returns = 1;
};

struct Design {
  std::vector<int> candidates;
  std::vector<double> shares;   ///< of the returns, for each candidate; sum 1
  Eigen::VectorXd sensitivity;  ///< of every candidate: derivative of -log(trace) by its share
  double trace = 0;             ///< of the covariance, geometric mean over the poses
  double min_trace = 0;         ///< lower bound over all designs (equivalence theorem)
};

/// The A-optimal design: shares that minimise the trace of the covariance (over several poses its
/// geometric mean, also convex), to a fraction `tolerance` of the reducible part, with at most
/// `max_candidates`. A vertex exchange method: candidates are added one by one by sensitivity;
/// between, shares are multiplied by the root of their sensitivities until these agree (Silvey,
/// Titterington and Torsney 1978; Yu 2010 proves convergence for independent returns). Empty when
/// no candidate has information.
Design a_optimal_design(const DesignProblem& problem, int max_candidates, double tolerance);

/// Integers near share * count with the sum count, by largest remainders.
std::vector<int> apportioned(const std::vector<double>& shares, int count);

}  // namespace berth::estimator
