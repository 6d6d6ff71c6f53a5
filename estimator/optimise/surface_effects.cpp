// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/optimise/surface_effects.h"

#include <cmath>

namespace berth::estimator {

Eigen::MatrixXd offset_covariance(const std::vector<SurfacePatch>& a,
                                  const std::vector<SurfacePatch>& b) {
  Eigen::MatrixXd k(a.size(), b.size());
  for (std::size_t j = 0; j < b.size(); ++j) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double la = a[i].correlation_length;
      const double lb = b[j].correlation_length;
      const double l2 = la * la + lb * lb;
      const double far = (a[i].place - b[j].place).squaredNorm() / l2;
      double value =
          a[i].sigma * b[j].sigma * a[i].direction.dot(b[j].direction) * std::exp(-far);
      if (la != lb) value *= std::pow(2 * la * lb / l2, 1.5);
      k(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = value;
    }
  }
  return k;
}

MarginalisedEquations::MarginalisedEquations(const NormalEquations& equations,
                                             const Eigen::MatrixXd& covariance)
    : equations_(equations) {
  const Eigen::Index n = covariance.rows();
  const Eigen::Index d = equations.information.rows();
  if (n == 0) {
    s_coupling_ = Eigen::MatrixXd::Zero(0, d);
    s_gradient_ = Eigen::VectorXd::Zero(0);
    information_ = equations.information;
    gradient_ = equations.gradient;
    return;
  }
  const Eigen::VectorXd root = equations.patch_information.cwiseSqrt();
  Eigen::MatrixXd b = root.asDiagonal() * covariance * root.asDiagonal();
  b.diagonal().array() += 1;
  factor_.compute(b);
  Eigen::MatrixXd sides(n, d + 1);
  sides << equations.coupling, equations.patch_gradient;
  const Eigen::MatrixXd k_sides = covariance * sides;
  Eigen::MatrixXd solved = root.asDiagonal() * k_sides;
  factor_.solveInPlace(solved);
  const Eigen::MatrixXd s = k_sides - covariance * (root.asDiagonal() * solved);
  s_coupling_ = s.leftCols(d);
  s_gradient_ = s.col(d);
  information_ = equations.information - equations.coupling.transpose() * s_coupling_;
  information_ = (0.5 * (information_ + information_.transpose())).eval();
  gradient_ = equations.gradient - equations.coupling.transpose() * s_gradient_;
}

void MarginalisedEquations::offsets(const Eigen::VectorXd& x, Eigen::VectorXd& delta,
                                    Eigen::VectorXd& alpha) const {
  delta = s_gradient_ - s_coupling_ * x;
  alpha = equations_.patch_gradient - equations_.coupling * x -
          equations_.patch_information.cwiseProduct(delta);
}

double MarginalisedEquations::determined(const Eigen::MatrixXd& p) const {
  const Eigen::Index n = s_gradient_.size();
  if (n == 0) return 0;
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(n, n);
  factor_.matrixL().solveInPlace(inverse);
  const double all = static_cast<double>(n) - inverse.squaredNorm();
  // tr (P H' S (I - N S) H)
  const Eigen::MatrixXd inner =
      equations_.coupling.transpose() * s_coupling_ -
      s_coupling_.transpose() * equations_.patch_information.asDiagonal() * s_coupling_;
  return all - (p * inner).trace();
}

Eigen::MatrixXd MarginalisedEquations::sensitivity(const Eigen::MatrixXd& p) const {
  const Eigen::MatrixXd h = equations_.coupling - equations_.patch_information.asDiagonal() *
                                                      s_coupling_;
  return p * h.transpose();
}

}  // namespace berth::estimator
