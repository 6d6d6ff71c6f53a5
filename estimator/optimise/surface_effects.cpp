// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/optimise/surface_effects.h"

#include <algorithm>
#include <cmath>

namespace berth::estimator {

double offset_covariance(const SurfacePatch& a, const SurfacePatch& b) {
  const double la = a.correlation_length;
  const double lb = b.correlation_length;
  const double l2 = la * la + lb * lb;
  const double value = a.sigma * b.sigma * a.direction.dot(b.direction) *
                       std::exp(-(a.place - b.place).squaredNorm() / l2);
  return la == lb ? value : value * std::pow(2 * la * lb / l2, 1.5);
}

OffsetCovariance::OffsetCovariance(const std::vector<SurfacePatch>& patches, double tolerance) {
  const auto n = static_cast<Eigen::Index>(patches.size());
  factor.resize(n, n);
  rest.resize(n);
  Eigen::VectorXd left(n);  // of 1
  for (Eigen::Index i = 0; i < n; ++i) {
    rest[i] = std::pow(patches[static_cast<std::size_t>(i)].sigma, 2);
    left[i] = 1;
  }
  const Eigen::VectorXd variance = rest;
  Eigen::Index rank = 0;
  for (; rank < n; ++rank) {
    Eigen::Index pivot = 0;
    if (!(left.maxCoeff(&pivot) > tolerance)) break;
    auto column = factor.col(rank);
    const SurfacePatch& p = patches[static_cast<std::size_t>(pivot)];
    for (Eigen::Index i = 0; i < n; ++i) {
      column[i] = offset_covariance(patches[static_cast<std::size_t>(i)], p);
    }
    column.noalias() -= factor.leftCols(rank) * factor.row(pivot).head(rank).transpose();
    column /= std::sqrt(rest[pivot]);
    rest = (rest - column.cwiseAbs2()).cwiseMax(0);
    rest[pivot] = 0;
    left = rest.cwiseQuotient(variance.cwiseMax(1e-300));
  }
  factor.conservativeResize(n, rank);
}

MarginalisedEquations::MarginalisedEquations(const NormalEquations& equations,
                                             const OffsetCovariance& covariance,
                                             const Eigen::VectorXd& scale)
    : equations_(equations), l_(scale.asDiagonal() * covariance.factor) {
  const Eigen::MatrixXd& h = equations.coupling;
  const Eigen::VectorXd& n = equations.patch_information;
  const Eigen::VectorXd rest = scale.cwiseAbs2().cwiseProduct(covariance.rest);
  kept_ = (1 + n.array() * rest.array()).inverse();
  own_ = rest.cwiseProduct(kept_);
  const Eigen::MatrixXd root = n.cwiseProduct(kept_).cwiseSqrt().asDiagonal() * l_;
  Eigen::MatrixXd b = Eigen::MatrixXd::Identity(root.cols(), root.cols());
  b.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose());
  factor_.compute(b);
  const Eigen::MatrixXd own_h = own_.asDiagonal() * h;
  coupling_ = l_.transpose() * (kept_.asDiagonal() * h);
  patch_gradient_ = l_.transpose() * kept_.cwiseProduct(equations.patch_gradient);
  Eigen::MatrixXd half = coupling_;
  factor_.matrixL().solveInPlace(half);
  Eigen::VectorXd half_gradient = patch_gradient_;
  factor_.matrixL().solveInPlace(half_gradient);
  information_ = equations.information - h.transpose() * own_h - half.transpose() * half;
  information_ = (0.5 * (information_ + information_.transpose())).eval();
  gradient_ = equations.gradient - own_h.transpose() * equations.patch_gradient -
              half.transpose() * half_gradient;
}

Eigen::VectorXd MarginalisedEquations::offsets(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd common = l_ * factor_.solve(patch_gradient_ - coupling_ * x);
  const Eigen::VectorXd left = equations_.patch_gradient - equations_.coupling * x -
                               equations_.patch_information.cwiseProduct(common);
  return common + own_.cwiseProduct(left);
}

Eigen::VectorXd MarginalisedEquations::offsets_squared(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd delta = offsets(x);
  return delta.cwiseProduct(equations_.patch_gradient - equations_.coupling * x -
                            equations_.patch_information.cwiseProduct(delta));
}

Eigen::VectorXd MarginalisedEquations::determined(const Eigen::MatrixXd& p) const {
  // S, of its diagonal; V = S H; U = (1 - N S) H
  Eigen::MatrixXd half = (kept_.asDiagonal() * l_).transpose();
  factor_.matrixL().solveInPlace(half);
  const Eigen::VectorXd s = half.colwise().squaredNorm().transpose() + own_;
  const Eigen::MatrixXd v = kept_.asDiagonal() * (l_ * factor_.solve(coupling_)) +
                            own_.asDiagonal() * equations_.coupling;
  const Eigen::MatrixXd u = equations_.coupling - equations_.patch_information.asDiagonal() * v;
  return s.cwiseProduct(equations_.patch_information) - (v * p).cwiseProduct(u).rowwise().sum();
}

}  // namespace berth::estimator
