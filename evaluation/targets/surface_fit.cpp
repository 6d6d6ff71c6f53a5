// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/targets/surface_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace berth::targets {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Normal equations of the departures at the cells (first), and of errors and angle (last).
struct NormalEquations {
  VectorXd cells;  ///< the diagonal; nothing joins two cells
  MatrixXd cross;  ///< cells x errors
  MatrixXd errors;
  VectorXd cell_vector;
  VectorXd error_vector;
};

NormalEquations equations_of(const SurfaceData& data, Index errors) {
  const auto n = static_cast<Index>(data.places.size());
  const Index all = errors + 1;  // the angle is the last
  NormalEquations sums{VectorXd::Zero(n), MatrixXd::Zero(n, all), MatrixXd::Zero(all, all),
                       VectorXd::Zero(n), VectorXd::Zero(all)};
  const Index runs = run_errors * static_cast<Index>(data.runs);
  Eigen::Matrix<Index, view_errors + run_errors + 1, 1> at;
  Eigen::Matrix<double, view_errors + run_errors + 1, 1> by;
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    const SurfaceView& view = data.views[v];
    for (Index i = 0; i < view_errors; ++i) at[i] = runs + view_errors * static_cast<Index>(v) + i;
    for (Index i = 0; i < run_errors; ++i) {
      at[view_errors + i] = run_errors * static_cast<Index>(view.run) + i;
    }
    at[view_errors + run_errors] = errors;
    for (const CellMean& mean : view.means) {
      const auto cell = static_cast<Index>(mean.cell);
      const double weight = 1 / mean.variance;
      by << mean.by_error, mean.by_angle;
      sums.cells[cell] += weight;
      sums.cell_vector[cell] += weight * mean.departure;
      for (Index i = 0; i < at.size(); ++i) {
        sums.cross(cell, at[i]) += weight * by[i];
        sums.error_vector[at[i]] += weight * by[i] * mean.departure;
        for (Index j = 0; j < at.size(); ++j) {
          sums.errors(at[i], at[j]) += weight * by[i] * by[j];
        }
      }
    }
  }
  return sums;
}

/// Of a field of unit variance at the cells, along their normals.
MatrixXd correlation_of(const SurfaceData& data, double length) {
  const auto n = static_cast<Index>(data.places.size());
  MatrixXd correlation(n, n);
  for (Index i = 0; i < n; ++i) {
    const auto a = static_cast<std::size_t>(i);
    for (Index j = 0; j <= i; ++j) {
      const auto b = static_cast<std::size_t>(j);
      const double d2 = (data.places[a] - data.places[b]).squaredNorm();
      correlation(i, j) = correlation(j, i) =
          data.normals[a].dot(data.normals[b]) * std::exp(-0.5 * d2 / (length * length));
    }
    correlation(i, i) += 1e-6;  // for its factor to exist
  }
  return correlation;
}

/// The likelihood of one correlation length as a function of the standard deviation: in the
/// eigenvectors of C' L C it is a sum, C C' the correlation.
class Likelihood {
 public:
  Likelihood(const SurfaceData& data, const MatrixXd& information, const VectorXd& vector,
             double length) {
    const MatrixXd factor = correlation_of(data, length).llt().matrixL();
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(factor.transpose() * information * factor);
    values_ = solver.eigenvalues().cwiseMax(0);
    const VectorXd projected = solver.eigenvectors().transpose() * (factor.transpose() * vector);
    squares_ = projected.cwiseAbs2();
  }

  double at(double sigma) const {
    const Eigen::ArrayXd gain = sigma * sigma / (1 + sigma * sigma * values_.array());
    return -0.5 *
           ((1 + sigma * sigma * values_.array()).log().sum() - (gain * squares_.array()).sum());
  }

 private:
  VectorXd values_;
  VectorXd squares_;
};

/// Golden section search for the greatest value of f between two places.
template <class Function>
double argmax(double low, double high, double tolerance, Function f) {
  const double part = 0.5 * (std::sqrt(5.0) - 1);
  double a = high - part * (high - low);
  double b = low + part * (high - low);
  double fa = f(a);
  double fb = f(b);
  while (high - low > tolerance) {
    if (fa > fb) {
      high = b;
      b = a;
      fb = fa;
      fa = f(a = high - part * (high - low));
    } else {
      low = a;
      a = b;
      fa = fb;
      fb = f(b = low + part * (high - low));
    }
  }
  return 0.5 * (low + high);
}

}  // namespace

ErrorInformation& ErrorInformation::operator+=(const ErrorInformation& other) {
  matrix += other.matrix;
  vector += other.vector;
  return *this;
}

SurfaceFit fit_surface(const SurfaceData& data, const ErrorInformation& known) {
  const Index errors = known.vector.size();
  const NormalEquations sums = equations_of(data, errors);
  // A part without a joint: its angle is known.
  const double of_angle = 1 / std::max(data.angle_sigma * data.angle_sigma, 1e-18);
  MatrixXd prior = MatrixXd::Zero(errors + 1, errors + 1);
  prior.topLeftCorner(errors, errors) = known.matrix;
  prior(errors, errors) = of_angle;
  VectorXd prior_vector = VectorXd::Zero(errors + 1);
  prior_vector.head(errors) = known.vector;
  const Eigen::LLT<MatrixXd> given_cells(prior + sums.errors);
  MatrixXd information = -sums.cross * given_cells.solve(sums.cross.transpose());
  information.diagonal() += sums.cells;
  const VectorXd vector =
      sums.cell_vector - sums.cross * given_cells.solve(prior_vector + sums.error_vector);
  Vector3d low = data.places.front();
  Vector3d high = low;
  for (const Vector3d& place : data.places) {
    low = low.cwiseMin(place);
    high = high.cwiseMax(place);
  }
  const double size = (high - low).norm();
  const double usual = std::log(size / 3);
  const double ln_low = std::log(1e-5);  // 10 um
  const double ln_high = std::log(0.5 * size);
  const auto score = [&](double ln_length, double* ln_sigma) {
    const Likelihood likelihood(data, information, vector, std::exp(ln_length));
    const double best =
        argmax(ln_low, ln_high, 1e-3, [&](double ln_s) { return likelihood.at(std::exp(ln_s)); });
    if (ln_sigma != nullptr) *ln_sigma = best;
    return likelihood.at(std::exp(best)) - 0.5 * (ln_length - usual) * (ln_length - usual);
  };
  // Several lengths first: the likelihood may have two summits.
  const double spacing = size / std::sqrt(static_cast<double>(data.places.size()));
  const double min_log_length = std::log(0.3 * spacing);
  const double max_log_length = std::log(size);
  constexpr int tries = 7;
  const double step = (max_log_length - min_log_length) / (tries - 1);
  double best = min_log_length;
  double best_score = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < tries; ++i) {
    const double value = score(min_log_length + i * step, nullptr);
    if (value > best_score) {
      best_score = value;
      best = min_log_length + i * step;
    }
  }
  best = argmax(best - step, best + step, 0.04, [&](double ln) { return score(ln, nullptr); });

  SurfaceFit fit;
  double ln_sigma = 0;
  const double middle = score(best, &ln_sigma);
  fit.correlation_length.value = std::exp(best);
  fit.sigma.value = std::exp(ln_sigma);
  // The length's from the curvature of its profile.
  constexpr double h = 0.1;
  const double curvature =
      (score(best - h, nullptr) + score(best + h, nullptr) - 2 * middle) / (h * h);
  const double length_variance = curvature < -1 ? -1 / curvature : 1;
  fit.correlation_length.sigma = fit.correlation_length.value * std::sqrt(length_variance);
  // Up to where the likelihood of any length has fallen by a half: as far as one standard deviation
  // of a normal one, and right also where the best s is none, or long lengths allow of more.
  double greatest = fit.sigma.value;
  for (int i = 0; i <= tries; ++i) {
    const double ln_length = i < tries ? min_log_length + i * step : best;
    const Likelihood of_length(data, information, vector, std::exp(ln_length));
    const double length_prior = 0.5 * (ln_length - usual) * (ln_length - usual);
    const auto allowed = [&](double ln_s) {
      return of_length.at(std::exp(ln_s)) - length_prior > middle - 0.5;
    };
    double inside =
        argmax(ln_low, ln_high, 1e-2, [&](double ln_s) { return of_length.at(std::exp(ln_s)); });
    if (!allowed(inside)) continue;
    double outside = ln_high;
    while (outside - inside > 1e-2) {
      const double ln_s = 0.5 * (inside + outside);
      (allowed(ln_s) ? inside : outside) = ln_s;
    }
    greatest = std::max(greatest, std::exp(outside));
  }
  fit.sigma.sigma = greatest - fit.sigma.value;

  // Information of the part on errors and angle, marginalised over its surface: with (K^-1 + N)^-1
  // = (I + K N)^-1 K, N diagonal.
  const MatrixXd covariance =
      fit.sigma.value * fit.sigma.value * correlation_of(data, fit.correlation_length.value);
  MatrixXd gained = covariance * sums.cells.asDiagonal();
  gained.diagonal().array() += 1;
  const MatrixXd surface = gained.partialPivLu().solve(covariance);
  const MatrixXd marginal = sums.errors - sums.cross.transpose() * surface * sums.cross;
  const VectorXd marginal_vector =
      sums.error_vector - sums.cross.transpose() * surface * sums.cell_vector;
  if (data.angle_sigma > 0) {
    const Eigen::LLT<MatrixXd> all(prior + marginal);
    fit.angle.value = all.solve(prior_vector + marginal_vector)[errors];
    fit.angle.sigma = std::sqrt(all.solve(VectorXd::Unit(errors + 1, errors))[errors]);
  }
  const VectorXd with_angle =
      marginal.col(errors).head(errors) / (of_angle + marginal(errors, errors));
  fit.errors.matrix = marginal.topLeftCorner(errors, errors) -
                      with_angle * marginal.col(errors).head(errors).transpose();
  fit.errors.vector = marginal_vector.head(errors) - with_angle * marginal_vector[errors];
  return fit;
}

}  // namespace berth::targets
