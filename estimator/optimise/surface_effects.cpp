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
                                             const OffsetCovariance& covariance, double scale)
    : equations_(equations), covariance_(covariance), scale_(scale) {
  const Eigen::MatrixXd& h = equations.coupling;
  const Eigen::VectorXd& n = equations.patch_information;
  const Eigen::VectorXd rest = scale * scale * covariance.rest;
  const Eigen::VectorXd kept = (1 + n.array() * rest.array()).inverse();
  own_ = rest.cwiseProduct(kept);
  const Eigen::MatrixXd root =
      n.cwiseProduct(kept).cwiseSqrt().asDiagonal() * (scale * covariance.factor);
  Eigen::MatrixXd b = Eigen::MatrixXd::Identity(root.cols(), root.cols());
  b.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose());
  factor_.compute(b);
  const Eigen::MatrixXd l = kept.asDiagonal() * (scale * covariance.factor);
  coupling_ = l.transpose() * h;
  patch_gradient_ = l.transpose() * equations.patch_gradient;
  Eigen::MatrixXd half = coupling_;
  factor_.matrixL().solveInPlace(half);
  Eigen::VectorXd half_gradient = patch_gradient_;
  factor_.matrixL().solveInPlace(half_gradient);
  const Eigen::MatrixXd own_h = own_.asDiagonal() * h;
  information_ = equations.information - h.transpose() * own_h - half.transpose() * half;
  information_ = (0.5 * (information_ + information_.transpose())).eval();
  gradient_ = equations.gradient - own_h.transpose() * equations.patch_gradient -
              half.transpose() * half_gradient;
}

/// The factor's coordinates of the most probable offsets.
Eigen::MatrixXd MarginalisedEquations::whitened(const Eigen::VectorXd& x) const {
  return factor_.solve(patch_gradient_ - coupling_ * x);
}

Eigen::VectorXd MarginalisedEquations::offsets(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd common = scale_ * (covariance_.factor * whitened(x));
  const Eigen::VectorXd left = equations_.patch_gradient - equations_.coupling * x -
                               equations_.patch_information.cwiseProduct(common);
  return common + own_.cwiseProduct(left);
}

double MarginalisedEquations::offsets_squared(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd z = whitened(x);
  const Eigen::VectorXd common = scale_ * (covariance_.factor * z);
  const Eigen::VectorXd left = equations_.patch_gradient - equations_.coupling * x -
                               equations_.patch_information.cwiseProduct(common);
  const Eigen::ArrayXd own = own_.array() * left.array();
  const Eigen::ArrayXd rest = scale_ * scale_ * covariance_.rest.array();
  return z.squaredNorm() + (rest > 1e-20).select(own.square() / rest.max(1e-20), 0).sum();
}

double MarginalisedEquations::determined(const Eigen::MatrixXd& p) const {
  const Eigen::Index rank = covariance_.factor.cols();
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(rank, rank);
  factor_.matrixL().solveInPlace(inverse);
  const double all =
      static_cast<double>(rank) - inverse.squaredNorm() + own_.dot(equations_.patch_information);
  // tr (P H' S (1 - N S) H) = tr (P (c' B^-1 c - c' B^-1 (B - 1) B^-1 c)), c = q L' H
  const Eigen::MatrixXd solved = factor_.solve(coupling_);
  return all - (p * (solved.transpose() * solved)).trace();
}

Eigen::MatrixXd MarginalisedEquations::sensitivity(const Eigen::MatrixXd& p) const {
  return p * factor_.solve(coupling_).transpose();
}

}  // namespace berth::estimator
