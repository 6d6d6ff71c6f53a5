// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/plan/optimal_design.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace berth::estimator {

namespace {

/// For symmetric A, the column whose product with packed(B) is trace(A B).
PackedMatrix dual(const Matrix6d& a) {
  PackedMatrix result = packed(2 * a);
  for (int row = 0, i = 0; row < 6; i += 6 - row, ++row) result[i] *= 0.5;
  return result;
}

/// State of the vertex exchange.
class Exchange {
 public:
  explicit Exchange(const DesignProblem& problem)
      : problem_(problem),
        prior_(packed(problem.prior)),
        slopes_(problem.information.size()),
        gain_(problem.returns / static_cast<double>(problem.information.size())),
        saturation_(Eigen::VectorXd::Ones(problem.information[0].cols())) {}

  /// Sets trace and slopes for the current shares.
  void evaluate(Design& design) {
    saturation_.setOnes();
    std::vector<double> counts;
    for (std::size_t i = 0; i < design.candidates.size(); ++i) {
      const int candidate = design.candidates[i];
      const double n = problem_.returns * design.shares[i];
      const double alone =
          1 + n * (problem_.correlation.size() > 0 ? problem_.correlation[candidate] : 0);
      counts.push_back(n / alone);
      saturation_[candidate] = 1 / (alone * alone);
    }
    double log_trace = 0;
    for (std::size_t k = 0; k < slopes_.size(); ++k) {
      PackedMatrix information = prior_;
      for (std::size_t i = 0; i < design.candidates.size(); ++i) {
        information += counts[i] * problem_.information[k].col(design.candidates[i]);
      }
      const Matrix6d covariance = unpacked(information).llt().solve(Matrix6d::Identity());
      const double trace = covariance.trace();
      log_trace += std::log(trace) / static_cast<double>(slopes_.size());
      slopes_[k] = gain_ / trace * dual(covariance * covariance);
    }
    design.trace = std::exp(log_trace);
  }

  /// Derivative of -log(trace) by a candidate's share; may be negative by rounding.
  double sensitivity(int candidate) const {
    double sum = 0;
    for (std::size_t k = 0; k < slopes_.size(); ++k) {
      sum += slopes_[k].dot(problem_.information[k].col(candidate));
    }
    return saturation_[candidate] * sum;
  }

  /// Of every candidate.
  void sensitivities(Eigen::VectorXd& all) const {
    all.noalias() = problem_.information[0].transpose() * slopes_[0];
    for (std::size_t k = 1; k < slopes_.size(); ++k) {
      all.noalias() += problem_.information[k].transpose() * slopes_[k];
    }
    all.array() *= saturation_.array();
  }

  double mean_sensitivity(const Design& design) const {
    double mean = 0;
    for (std::size_t i = 0; i < design.candidates.size(); ++i) {
      mean += design.shares[i] * std::max(0.0, sensitivity(design.candidates[i]));
    }
    return mean;
  }

  /// Multiplicative updates of the design's shares.
  void balance(Design& design, double tolerance) {
    constexpr int max_rounds = 6;  // the next exchange comes soon
    constexpr double min_share = 1e-3;
    for (int round = 0; round < max_rounds; ++round) {
      double mean = 0;
      double max_sensitivity = 0;
      double sum = 0;
      std::vector<double> shares = design.shares;
      for (std::size_t i = 0; i < shares.size(); ++i) {
        const double s = std::max(0.0, sensitivity(design.candidates[i]));
        mean += shares[i] * s;
        max_sensitivity = std::max(max_sensitivity, s);
        shares[i] *= std::sqrt(s);
        sum += shares[i];
      }
      if (max_sensitivity - mean < tolerance * mean || !(sum > 0)) break;
      for (double& share : shares) share /= sum;
      design.shares = std::move(shares);
      evaluate(design);
    }
    // Removes candidates with negligible shares.
    std::size_t kept = 0;
    for (std::size_t i = 0; i < design.shares.size(); ++i) {
      if (design.shares[i] < min_share) continue;
      design.candidates[kept] = design.candidates[i];
      design.shares[kept++] = design.shares[i];
    }
    if (kept == design.shares.size()) return;
    design.candidates.resize(kept);
    design.shares.resize(kept);
    const double sum = std::accumulate(design.shares.begin(), design.shares.end(), 0.0);
    for (double& share : design.shares) share /= sum;
    evaluate(design);
  }

 private:
  const DesignProblem& problem_;
  PackedMatrix prior_;
  std::vector<PackedMatrix> slopes_;  // of log(trace), against a candidate's information
  double gain_;
  Eigen::VectorXd saturation_;  // of each candidate: derivative of n / (1 + n correlation) by n
};

}  // namespace

PackedMatrix packed_square(const Vector6d& root) {
  PackedMatrix result;
  for (int row = 0, i = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) result[i++] = root[row] * root[column];
  }
  return result;
}

PackedMatrix packed(const Matrix6d& symmetric) {
  PackedMatrix result;
  for (int row = 0, i = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) result[i++] = symmetric(row, column);
  }
  return result;
}

Matrix6d unpacked(const PackedMatrix& matrix) {
  Matrix6d result;
  for (int row = 0, i = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column, ++i) {
      result(row, column) = matrix[i];
      result(column, row) = matrix[i];
    }
  }
  return result;
}

Design a_optimal_design(const DesignProblem& problem, int max_candidates, double tolerance) {
  Design design;
  if (problem.information.empty() || problem.information[0].cols() == 0) return design;
  constexpr int max_exchanges = 80;
  constexpr std::size_t parameters = 6;  // fewer candidates do not determine a pose
  Exchange exchange(problem);
  exchange.evaluate(design);
  for (int i = 0; i < max_exchanges; ++i) {
    exchange.sensitivities(design.sensitivity);
    int best = 0;
    const double max_sensitivity = design.sensitivity.maxCoeff(&best);
    if (!(max_sensitivity > 0)) break;
    const double mean = exchange.mean_sensitivity(design);
    design.min_trace = std::max(design.min_trace, design.trace * std::exp(mean - max_sensitivity));
    if (!design.candidates.empty() && max_sensitivity - mean < tolerance * mean) break;
    auto& shares = design.shares;
    const bool known = std::find(design.candidates.begin(), design.candidates.end(), best) !=
                       design.candidates.end();
    if (!known) {
      if (static_cast<int>(shares.size()) == max_candidates) {
        const auto smallest = std::min_element(shares.begin(), shares.end());
        design.candidates.erase(design.candidates.begin() + (smallest - shares.begin()));
        shares.erase(smallest);
      }
      const double others = std::accumulate(shares.begin(), shares.end(), 0.0);
      const double share = 1 / (static_cast<double>(shares.size()) + 1);
      for (double& s : shares) s *= (1 - share) / others;
      design.candidates.push_back(best);
      shares.push_back(share);
    }
    exchange.evaluate(design);
    if (known || shares.size() >= parameters) {
      exchange.balance(design, 0.3 * tolerance);
    }
  }
  return design;
}

std::vector<int> apportioned(const std::vector<double>& shares, int count) {
  std::vector<int> counts;
  int left = count;
  for (const double share : shares) {
    counts.push_back(static_cast<int>(std::floor(share * count)));
    left -= counts.back();
  }
  std::vector<std::size_t> order(shares.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto remainder = [&](std::size_t i) { return shares[i] * count - counts[i]; };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return remainder(a) > remainder(b); });
  for (std::size_t i = 0; left > 0 && !order.empty(); i = (i + 1) % order.size(), --left) {
    ++counts[order[i]];
  }
  return counts;
}

}  // namespace berth::estimator
