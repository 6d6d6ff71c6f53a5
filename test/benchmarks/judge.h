// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/pose.h"
#include "evaluation/trials/acquisition_trial.h"

namespace berth::benchmark {

using trials::Verdict;

/// How answers without any prior were judged.
struct Tally {
  int trials = 0;
  int right = 0;
  int ambiguous_with_truth = 0;
  int ambiguous_without = 0;
  int silently_wrong = 0;
  int lost = 0;               ///< in all
  int lost_though_right = 0;  ///< of those, with the right pose as first hypothesis

  /// first_right: whether the first hypothesis is right, whatever is claimed of it.
  void add(Verdict verdict, bool first_right);
  void add(const Tally& other);
  /// Cells of a table, under the names of columns(): shares with intervals.
  std::vector<std::string> cells() const;
  static std::vector<std::string> columns();
};

/// Normalised estimation error squared, e' P^-1 e. error: as berth::difference(truth, estimate).
/// Infinite when P is no covariance: what claims nothing that can be checked is not consistent.
double normalised_error_squared(const Vector6d& error, const Matrix6d& covariance);

/// Whether an error of six degrees of freedom lies within "3 sigma" of its covariance: in the
/// ellipsoid that holds 99.73 % of a normal distribution, e' P^-1 e <= 20.06.
bool within_three_sigma(const Vector6d& error, const Matrix6d& covariance);

}  // namespace berth::benchmark
