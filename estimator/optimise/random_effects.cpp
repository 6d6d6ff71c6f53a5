// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/optimise/random_effects.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace berth::estimator {
namespace {

OffsetCovariance::Field pivoted_cholesky(SurfaceField field,
                                         const std::vector<SurfacePatch>& patches,
                                         const Eigen::VectorXd& information, double tolerance) {
  const auto n = static_cast<Eigen::Index>(patches.size());
  OffsetCovariance::Field result;
  Eigen::MatrixXd& factor = result.factor;
  factor.resize(n, n);
  result.residual.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const SurfacePatch& patch = patches[static_cast<std::size_t>(i)];
    result.residual[i] = offset_covariance(field, patch, patch);
  }
  Eigen::Index rank = 0;
  for (; rank < n; ++rank) {
    Eigen::Index pivot = 0;
    if (!(result.residual.cwiseProduct(information).maxCoeff(&pivot) > 0)) break;
    auto column = factor.col(rank);
    const SurfacePatch& p = patches[static_cast<std::size_t>(pivot)];
    for (Eigen::Index i = 0; i < n; ++i) {
      column[i] = offset_covariance(field, patches[static_cast<std::size_t>(i)], p);
    }
    column.noalias() -= factor.leftCols(rank) * factor.row(pivot).head(rank).transpose();
    column /= std::sqrt(result.residual[pivot]);
    if (!(column.cwiseAbs2().dot(information) > tolerance)) break;
    result.residual = (result.residual - column.cwiseAbs2()).cwiseMax(0);
    result.residual[pivot] = 0;
  }
  factor.conservativeResize(n, rank);
  return result;
}

}  // namespace

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
    const double factor = o.piece < 0 ? 1.0 : piece_weights[static_cast<std::size_t>(o.piece)];
    const double w = o.weight * factor;
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

std::uint64_t cell_of(const Vector3d& place, double size) {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    const auto cell = static_cast<std::int64_t>(std::floor(place[i] / size)) + (1 << 20);
    key = (key << 21) | (static_cast<std::uint64_t>(cell) & 0x1fffff);
  }
  return key;
}

double offset_covariance(SurfaceField field, const SurfacePatch& a, const SurfacePatch& b) {
  FieldScales scales{};
  scales[static_cast<std::size_t>(field)] = 1;
  return offset_covariance(scales, a, b);
}

double offset_covariance(const FieldScales& scales, const SurfacePatch& a, const SurfacePatch& b) {
  const auto squared = [&scales](SurfaceField field) {
    const double q = scales[static_cast<std::size_t>(field)];
    return q * q;
  };
  const double aligned =
      (a.rim == b.rim ? 1 : -1) * a.slant * b.slant * a.direction.dot(b.direction);
  const double fields = squared(SurfaceField::displacement) * aligned +
                        (a.rim || b.rim ? 0 : squared(SurfaceField::line_of_sight));
  if (fields == 0) return 0;
  const double la = a.correlation_length;
  const double lb = b.correlation_length;
  const double l2 = la * la + lb * lb;
  const double correlation = std::exp(-(a.place - b.place).squaredNorm() / l2);
  const double scale = la == lb ? 1 : std::pow(2 * la * lb / l2, 1.5);
  return a.sigma * b.sigma * scale * correlation * fields;
}

OffsetCovariance::OffsetCovariance(const std::vector<SurfacePatch>& patches,
                                   const NormalEquations& equations, const FieldScales& scales,
                                   double tolerance) {
  for (std::size_t f = 0; f < fields.size(); ++f) {
    fields[f] = pivoted_cholesky(surface_fields[f], patches,
                                 scales[f] * scales[f] * equations.patch_information, tolerance);
  }
}

MarginalisedEquations::MarginalisedEquations(NormalEquations equations,
                                             const OffsetCovariance& covariance,
                                             const FieldScales& scales)
    : equations_(std::move(equations)) {
  const Eigen::MatrixXd& h = equations_.coupling;
  const Eigen::VectorXd& n = equations_.patch_information;
  Eigen::Index rank = 0;
  for (std::size_t f = 0; f < scales.size(); ++f) {
    ranks_[f] = covariance.fields[f].factor.cols();
    rank += ranks_[f];
  }
  l_.resize(n.size(), rank);
  Eigen::VectorXd residual = Eigen::VectorXd::Zero(n.size());
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < scales.size(); ++f) {
    if (n.size() == 0) break;
    l_.middleCols(at, ranks_[f]) = covariance.fields[f].factor;
    residual += scales[f] * scales[f] * covariance.fields[f].residual;
    at += ranks_[f];
  }
  const Eigen::VectorXd kept = (1 + n.array() * residual.array()).inverse();
  independent_ = residual.cwiseProduct(kept);
  const Eigen::MatrixXd root = n.cwiseProduct(kept).cwiseSqrt().asDiagonal() * l_;
  gram_ = Eigen::MatrixXd::Zero(rank, rank);
  gram_.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose());
  h_ = l_.transpose() * (kept.asDiagonal() * h);
  g_ = l_.transpose() * kept.cwiseProduct(equations_.patch_gradient);
  const Eigen::MatrixXd own_h = independent_.asDiagonal() * h;
  rigid_ = equations_.information - h.transpose() * own_h;
  rigid_gradient_ = equations_.gradient - own_h.transpose() * equations_.patch_gradient;
  rescale(scales);
}

void MarginalisedEquations::rescale(const FieldScales& scales) {
  scale_.resize(l_.cols());
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < scales.size(); ++f) {
    scale_.segment(at, ranks_[f]).setConstant(scales[f]);
    at += ranks_[f];
  }
  Eigen::MatrixXd b = scale_.asDiagonal() * gram_ * scale_.asDiagonal();
  b.diagonal().array() += 1;
  factor_.compute(b);
  coupling_ = scale_.asDiagonal() * h_;
  patch_gradient_ = scale_.cwiseProduct(g_);
  Eigen::MatrixXd half = coupling_;
  factor_.matrixL().solveInPlace(half);
  Eigen::VectorXd half_gradient = patch_gradient_;
  factor_.matrixL().solveInPlace(half_gradient);
  information_ = rigid_ - half.transpose() * half;
  information_ = (0.5 * (information_ + information_.transpose())).eval();
  gradient_ = rigid_gradient_ - half.transpose() * half_gradient;
}

/// Of the fields, in which offsets are L z.
Eigen::VectorXd MarginalisedEquations::coordinates(const Eigen::VectorXd& x) const {
  return factor_.solve(patch_gradient_ - coupling_ * x);
}

Eigen::MatrixXd MarginalisedEquations::systematic_score_covariance() const {
  const Eigen::MatrixXd& h = equations_.coupling;
  const auto n = equations_.patch_information.asDiagonal();
  const Eigen::MatrixXd common = l_ * (scale_.asDiagonal() * factor_.solve(coupling_));
  const Eigen::MatrixXd sh = common + independent_.asDiagonal() * (h - n * common);
  const Eigen::MatrixXd covariance = h.transpose() * sh - sh.transpose() * (n * sh);
  return 0.5 * (covariance + covariance.transpose());
}

Eigen::VectorXd MarginalisedEquations::offsets(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd common = l_ * scale_.cwiseProduct(coordinates(x));
  const Eigen::VectorXd remaining = equations_.patch_gradient - equations_.coupling * x -
                                    equations_.patch_information.cwiseProduct(common);
  return common + independent_.cwiseProduct(remaining);
}

double MarginalisedEquations::offsets_squared(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd delta = offsets(x);
  return delta.dot(equations_.patch_gradient - equations_.coupling * x -
                   equations_.patch_information.cwiseProduct(delta));
}

std::array<MarginalisedEquations::FieldEvidence, surface_fields.size()>
MarginalisedEquations::evidence(const Eigen::MatrixXd& p, const Eigen::VectorXd& x) const {
  const Eigen::VectorXd z = coordinates(x);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(z.size(), z.size());
  factor_.matrixL().solveInPlace(inverse);
  const Eigen::VectorXd remaining = inverse.colwise().squaredNorm();  // diagonal of (1 + L' N L)^-1
  const Eigen::MatrixXd solved = factor_.solve(coupling_);
  const Eigen::VectorXd by_x = (solved * p).cwiseProduct(solved).rowwise().sum();
  std::array<FieldEvidence, surface_fields.size()> result;
  Eigen::Index at = 0;
  for (std::size_t f = 0; f < result.size(); ++f) {
    result[f].squared = z.segment(at, ranks_[f]).squaredNorm();
    result[f].well_determined = static_cast<double>(ranks_[f]) -
                                remaining.segment(at, ranks_[f]).sum() -
                                by_x.segment(at, ranks_[f]).sum();
    at += ranks_[f];
  }
  return result;
}

}  // namespace berth::estimator
