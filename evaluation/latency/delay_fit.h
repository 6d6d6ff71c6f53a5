// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "common/bus/loop.h"
#include "common/core/pose.h"

namespace berth::evaluation {

/// The error of a follower against its leader at one time, six numbers each: a pose against truth,
/// an arm's joints against those commanded.
struct DelaySample {
  static constexpr int max_nuisances = 33;
  using Design = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, max_nuisances>;

  Utime utime = 0;
  Vector6d error;        ///< of the follower against the leader
  Vector6d rate;         ///< of the leader, per second
  Matrix6d information;  ///< inverse of the error's covariance, as far as that is known
  Design nuisances;      ///< derivative of the error by the other unknowns
  /// How these change with the delay that is taken off, per second; empty: they do not.
  Design nuisance_rates;
};

struct DelayProblem {
  /// The samples with this delay, s, already removed: the error is follower(t) - leader(t - delay).
  std::function<std::vector<DelaySample>(double delay)> samples;
  /// 1 sigma of each nuisance before the data speak.
  Eigen::VectorXd nuisance_sigma;
};

/// A delay with its confidence interval.
struct DelayFit {
  static constexpr std::size_t min_samples = 5;
  static constexpr double unknown = std::numeric_limits<double>::infinity();

  /// s, by which the follower is later; NaN: there was no motion, or no data.
  double delay = std::numeric_limits<double>::quiet_NaN();
  double sigma = unknown;        ///< standard error, s
  double half_width = unknown;   ///< s, of the 95 % interval about the delay
  double sigma_information = 0;  ///< standard error by the samples' covariances
  double sigma_bootstrap = 0;    ///< the same by drawing blocks of neighbours again
  double sigma_offset = 0;       ///< contribution of the nuisances' prior uncertainty
  std::size_t samples = 0;
  std::size_t block = 1;  ///< neighbours drawn together
};

/// Least squares for one delay d and the nuisances b: error = nuisances b - rate d. Outliers weigh
/// less (Huber 1964); the scale of their covariances is found from the scatter. The standard error
/// is the larger of that of the scaled covariances and that of a block bootstrap of the samples'
/// influences, which includes the correlation of neighbours; the uncertainty of the nuisances is
/// added to both.
DelayFit fit_delay(const DelayProblem& problem);

}  // namespace berth::evaluation
