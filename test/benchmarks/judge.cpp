// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/judge.h"

#include <Eigen/Cholesky>
#include <limits>

#include "common/core/covariance.h"
#include "test/benchmarks/statistics.h"
#include "test/benchmarks/table.h"

namespace berth::benchmark {

void Tally::add(Verdict verdict, bool first_right) {
  ++trials;
  switch (verdict) {
    case Verdict::right:
      ++right;
      break;
    case Verdict::ambiguous_with_truth:
      ++ambiguous_with_truth;
      break;
    case Verdict::ambiguous_without:
      ++ambiguous_without;
      break;
    case Verdict::silently_wrong:
      ++silently_wrong;
      break;
    case Verdict::lost:
      ++lost;
      if (first_right) ++lost_though_right;
      break;
  }
}

void Tally::add(const Tally& other) {
  trials += other.trials;
  right += other.right;
  ambiguous_with_truth += other.ambiguous_with_truth;
  ambiguous_without += other.ambiguous_without;
  silently_wrong += other.silently_wrong;
  lost += other.lost;
  lost_though_right += other.lost_though_right;
}

std::vector<std::string> Tally::columns() {
  return {"trials",         "right", "ambiguous with truth",   "ambiguous without",
          "silently wrong", "lost",  "lost though right first"};
}

std::vector<std::string> Tally::cells() const {
  std::vector<std::string> cells = {std::to_string(trials)};
  for (const int count :
       {right, ambiguous_with_truth, ambiguous_without, silently_wrong, lost, lost_though_right}) {
    cells.push_back(share(count, trials));
  }
  return cells;
}

double normalised_error_squared(const Vector6d& error, const Matrix6d& covariance) {
  if (!is_covariance(covariance)) return std::numeric_limits<double>::infinity();
  return error.dot(covariance.ldlt().solve(error));
}

bool within_three_sigma(const Vector6d& error, const Matrix6d& covariance) {
  static const double limit = chi_squared_quantile(0.9973, 6);
  return normalised_error_squared(error, covariance) <= limit;
}

}  // namespace berth::benchmark
