// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/latency/delay_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/nan.h"
#include "common/core/statistics.h"
#include "evaluation/measure/bootstrap.h"

namespace berth::evaluation {
namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();
constexpr int rounds = 6;              // of weights, scale and a new linearisation
constexpr double huber = 1.5;          // standard deviations from which a sample weighs less
constexpr double chi2_median = 5.348;  // of six degrees of freedom
constexpr double min_scale = 1e-6;     // less than that is rounding
constexpr std::size_t resamples = 1000;

/// The delay first, then the nuisances.
using Columns =
    Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, DelaySample::max_nuisances + 1>;

struct Solution {
  Eigen::VectorXd value;       // of the step in the delay, then the nuisances
  Eigen::MatrixXd inverse;     // of the normal matrix, with the prior
  Eigen::MatrixXd data;        // the normal matrix of the samples alone
  std::vector<double> weight;  // of each sample's information, the scale included
};

class Fit {
 public:
  explicit Fit(const DelayProblem& problem) : problem_(problem) {}

  DelayFit run() {
    result_.delay = 0;
    nuisances_ = Eigen::VectorXd::Zero(problem_.nuisance_sigma.size());
    for (int round = 0; round < rounds; ++round) {
      samples_ = problem_.samples(result_.delay);
      result_.samples = samples_.size();
      if (!enough()) return refused();
      if (round == 0 || solution_.weight.size() != samples_.size()) start();
      solve();
      if (!solution_.value.allFinite()) return refused();
      result_.delay += solution_.value(0);
      // A delay that motion too slow for the noise leaves undetermined would diverge.
      if (!(std::abs(result_.delay) < max_delay)) return refused();
      reweight();
      if (round + 1 < rounds) nuisances_ = solution_.value.tail(nuisances_.size());
    }
    validate();
    return result_;
  }

 private:
  static constexpr double max_delay = 2;  // s

  /// More numbers than unknowns, and some motion.
  bool enough() const {
    const auto moves = [](const DelaySample& s) { return !s.rate.isZero(0); };
    return samples_.size() >= DelayFit::min_samples &&
           std::any_of(samples_.begin(), samples_.end(), moves);
  }

  DelayFit refused() {
    result_.delay = nan;
    result_.sigma = result_.half_width = unlimited;
    return result_;
  }

  void start() {
    solution_.weight.assign(samples_.size(), 1.0);
    scale_ = 1;
  }

  void solve() {
    const Eigen::Index n = 1 + problem_.nuisance_sigma.size();
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Columns x = columns_of(samples_[i]);
      const Columns weighted = solution_.weight[i] * (samples_[i].information * x);
      normal.noalias() += x.transpose() * weighted;
      right.noalias() += weighted.transpose() * samples_[i].error;
    }
    solution_.data = normal;
    normal.diagonal().tail(n - 1) += problem_.nuisance_sigma.cwiseAbs2().cwiseInverse();
    const Eigen::LDLT<Eigen::MatrixXd> factor(normal);
    solution_.inverse = factor.solve(Eigen::MatrixXd::Identity(n, n));
    solution_.value = factor.solve(right);
  }

  /// The delay's column is that of the error less the contribution of the nuisances found so far.
  Columns columns_of(const DelaySample& sample) const {
    Columns columns(6, sample.nuisances.cols() + 1);
    columns << -sample.rate, sample.nuisances;
    if (sample.nuisance_rates.cols() > 0) columns.col(0) += sample.nuisance_rates * nuisances_;
    return columns;
  }

  Vector6d residual(std::size_t i) const {
    return samples_[i].error - columns_of(samples_[i]) * solution_.value;
  }

  /// The scale from the median distance, then each sample's weight by its own.
  void reweight() {
    std::vector<double> squares(samples_.size());
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Vector6d r = residual(i);
      squares[i] = r.dot(samples_[i].information * r);
    }
    // Few samples are fitted more closely than they scatter.
    const double free = std::max(1.0, 6 * static_cast<double>(samples_.size()) - unknowns());
    const double fitted = 6 * static_cast<double>(samples_.size()) / free;
    scale_ = std::max(upper_median(squares) / chi2_median * fitted, min_scale);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const double distance = std::sqrt(squares[i] / (6 * scale_));
      solution_.weight[i] = std::min(1.0, huber / distance) / scale_;
    }
  }

  /// Numbers that the samples, and not the prior, decide.
  double unknowns() const { return (solution_.inverse * solution_.data).trace(); }

  void validate() {
    const Eigen::VectorXd row = solution_.inverse.row(0);
    const double all = solution_.inverse(0, 0);
    const double from_data = row.dot(solution_.data * row);
    result_.sigma_information = std::sqrt(std::max(0.0, from_data));
    result_.sigma_offset = std::sqrt(std::max(0.0, all - from_data));

    std::vector<double> influence(samples_.size());
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Columns x = columns_of(samples_[i]);
      influence[i] = solution_.weight[i] * (x * row).dot(samples_[i].information * residual(i));
    }
    const auto numbers = 6 * static_cast<double>(samples_.size());
    const double free = std::max(1.0, numbers - unknowns());
    result_.block = block_length(influence);
    BootstrapOptions options;
    options.resamples = resamples;
    const Interval drawn = bca_interval(
        samples_.size(), result_.block,
        [&influence](const std::vector<std::size_t>& places) {
          double sum = 0;
          for (const std::size_t place : places) sum += influence[place];
          return sum;
        },
        options);
    result_.sigma_bootstrap = drawn.sigma * std::sqrt(numbers / free);
    const double scatter = std::max(result_.sigma_information, result_.sigma_bootstrap);
    result_.sigma = std::hypot(scatter, result_.sigma_offset);
    const double blocks = static_cast<double>(samples_.size()) / static_cast<double>(result_.block);
    result_.half_width = std::hypot(students_t_quantile(0.975, std::max(1.0, blocks - 1)) * scatter,
                                    1.96 * result_.sigma_offset);
  }

  const DelayProblem& problem_;
  std::vector<DelaySample> samples_;
  Solution solution_;
  Eigen::VectorXd nuisances_;  // of the round before
  double scale_ = 1;
  DelayFit result_;
};

}  // namespace

DelayFit fit_delay(const DelayProblem& problem) { return Fit(problem).run(); }

}  // namespace berth::evaluation
