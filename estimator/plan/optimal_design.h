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

/// Among which candidates returns are to be shared out.
struct DesignProblem {
  /// One matrix per pose that the target may have; column i: information of one return of
  /// candidate i there.
  std::vector<Eigen::Matrix<double, 21, Eigen::Dynamic>> information;
  /// Of each candidate: n returns there say n / (1 + n alike) times as much as one that errs by
  /// itself. Empty: all err by themselves.
  Eigen::VectorXd alike;
  Matrix6d prior = Matrix6d::Identity();  ///< what is known without returns: positive definite
  double returns = 1;
};

struct Design {
  std::vector<int> candidates;
  std::vector<double> shares;   ///< of the returns, of each of these; sum 1
  Eigen::VectorXd sensitivity;  ///< of every candidate: how fast returns there lower log(trace)
  double trace = 0;             ///< of the covariance, geometric mean over the poses
  double min_trace = 0;         ///< no design has a smaller one (equivalence theorem)
};

/// The A-optimal design: the shares that minimise the covariance's trace (its geometric mean, where
/// there are several poses: a convex function too), to within a fraction `tolerance` of the part of
/// it that returns lower, or as well as `max_candidates` can.
/// Candidates are taken up one by one, each time the one that lowers the trace fastest; between,
/// shares are multiplied by the root of their sensitivities until these agree (Silvey, Titterington
/// and Torsney 1978; Yu 2010 for the proof that this converges where no candidate's returns err
/// alike). Empty when no candidate has information.
Design a_optimal_design(const DesignProblem& problem, int max_candidates, double tolerance);

/// Whole numbers near share * count that sum up to count: those with the largest remainders are
/// rounded up.
std::vector<int> apportioned(const std::vector<double>& shares, int count);

}  // namespace berth::estimator
