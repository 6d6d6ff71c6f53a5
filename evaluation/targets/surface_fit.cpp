// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/targets/surface_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace berth::targets {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Information on the departures at the cells, all else marginalised.
struct Information {
  MatrixXd matrix;
  VectorXd vector;
  VectorXd by_angle;    ///< information between cells and angle
  double of_angle = 0;  ///< of the angle, cells given
  double angle_vector = 0;
};

Information information_of(const SurfaceData& data) {
  const auto n = static_cast<Eigen::Index>(data.places.size());
  Information info{MatrixXd::Zero(n, n), VectorXd::Zero(n), VectorXd::Zero(n), 0, 0};
  for (const SurfaceView& view : data.views) {
    // Columns: 7 errors. Rows: cells, then the angle.
    MatrixXd cross = MatrixXd::Zero(n + 1, 7);
    Eigen::Matrix<double, 7, 7> own = Eigen::Matrix<double, 7, 7>::Zero();
    ViewErrors vector = ViewErrors::Zero();
    for (const CellMean& mean : view.means) {
      const auto cell = static_cast<Eigen::Index>(mean.cell);
      const double weight = 1 / mean.variance;
      const double a = mean.by_angle;
      info.matrix(cell, cell) += weight;
      info.vector[cell] += weight * mean.departure;
      info.by_angle[cell] += weight * a;
      info.of_angle += weight * a * a;
      info.angle_vector += weight * a * mean.departure;
      cross.row(cell) += weight * mean.by_error.transpose();
      cross.row(n) += weight * a * mean.by_error.transpose();
      own += weight * mean.by_error * mean.by_error.transpose();
      vector += weight * mean.departure * mean.by_error;
    }
    // (C^-1 + G'WG)^-1 without inverting C, which may be singular.
    const Eigen::Matrix<double, 7, 7> spread =
        (Eigen::Matrix<double, 7, 7>::Identity() + view.covariance * own)
            .partialPivLu()
            .solve(view.covariance);
    const MatrixXd lost = cross * spread;
    info.matrix -= lost.topRows(n) * cross.topRows(n).transpose();
    info.vector -= lost.topRows(n) * vector;
    info.by_angle -= lost.topRows(n) * cross.row(n).transpose();
    info.of_angle -= (lost.row(n) * cross.row(n).transpose()).value();
    info.angle_vector -= (lost.row(n) * vector).value();
  }
  return info;
}

/// The likelihood of one correlation length as a function of the standard deviation: in the
/// eigenvectors of L' C L it is a sum.
class Likelihood {
 public:
  Likelihood(const std::vector<Vector3d>& places, const MatrixXd& information,
             const VectorXd& vector, double length) {
    const auto n = static_cast<Eigen::Index>(places.size());
    MatrixXd correlation(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j <= i; ++j) {
        const double d2 =
            (places[static_cast<std::size_t>(i)] - places[static_cast<std::size_t>(j)])
                .squaredNorm();
        correlation(i, j) = correlation(j, i) = std::exp(-0.5 * d2 / (length * length));
      }
      correlation(i, i) += 1e-6;  // for the factor to exist
    }
    const MatrixXd factor = correlation.llt().matrixL();
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

SurfaceFit fit_surface(const SurfaceData& data) {
  const Information info = information_of(data);
  MatrixXd information = info.matrix;
  VectorXd vector = info.vector;
  if (data.angle_sigma > 0) {
    const double spread = 1 / (1 / (data.angle_sigma * data.angle_sigma) + info.of_angle);
    information -= spread * info.by_angle * info.by_angle.transpose();
    vector -= spread * info.angle_vector * info.by_angle;
  }
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
    const Likelihood likelihood(data.places, information, vector, std::exp(ln_length));
    const double best =
        argmax(ln_low, ln_high, 1e-3, [&](double ln_s) { return likelihood.at(std::exp(ln_s)); });
    if (ln_sigma != nullptr) *ln_sigma = best;
    return likelihood.at(std::exp(best)) - 0.5 * (ln_length - usual) * (ln_length - usual);
  };
  // Several lengths first: the likelihood may have two summits.
  const double spacing = size / std::sqrt(static_cast<double>(data.places.size()));
  const double shortest = std::log(0.3 * spacing);
  const double longest = std::log(size);
  constexpr int tries = 7;
  const double step = (longest - shortest) / (tries - 1);
  double best = shortest;
  double best_score = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < tries; ++i) {
    const double value = score(shortest + i * step, nullptr);
    if (value > best_score) {
      best_score = value;
      best = shortest + i * step;
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
    const double ln_length = i < tries ? shortest + i * step : best;
    const Likelihood of_length(data.places, information, vector, std::exp(ln_length));
    const double prior = 0.5 * (ln_length - usual) * (ln_length - usual);
    const auto allowed = [&](double ln_s) {
      return of_length.at(std::exp(ln_s)) - prior > middle - 0.5;
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

  if (data.angle_sigma > 0) {
    const auto n = static_cast<Eigen::Index>(data.places.size());
    MatrixXd covariance(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        const double d2 =
            (data.places[static_cast<std::size_t>(i)] - data.places[static_cast<std::size_t>(j)])
                .squaredNorm();
        covariance(i, j) =
            fit.sigma.value * fit.sigma.value *
            (std::exp(-0.5 * d2 / std::pow(fit.correlation_length.value, 2)) + (i == j ? 1e-6 : 0));
      }
    }
    // (K^-1 + L)^-1 = (I + K L)^-1 K
    const Eigen::PartialPivLU<MatrixXd> lu(MatrixXd::Identity(n, n) + covariance * info.matrix);
    const VectorXd by_angle = lu.solve(covariance * info.by_angle);
    const VectorXd by_vector = lu.solve(covariance * info.vector);
    const double precision =
        1 / (data.angle_sigma * data.angle_sigma) + info.of_angle - info.by_angle.dot(by_angle);
    fit.angle.value = (info.angle_vector - info.by_angle.dot(by_vector)) / precision;
    fit.angle.sigma = 1 / std::sqrt(precision);
  }
  return fit;
}

}  // namespace berth::targets
