// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <cmath>

#include "common/core/covariance.h"
#include "common/core/nan.h"
#include "common/core/statistics.h"
#include "common/core/text.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

/// Normalised estimation error squared, against the estimate's and truth's covariance together. NaN
/// when the estimate has no covariance. Where truth's part of their sum is the share s, an
/// estimate's covariance that is wrong by a factor shows only in the rest: truth's covariance,
/// known to half of itself at best, leaves 6 s / 2 uncertain.
Uncertain nees(const ComparedEstimate& c) {
  const Matrix6d sum = c.estimate.covariance + c.truth.covariance;
  if (!is_covariance(c.estimate.covariance) || !is_covariance(sum)) return {nan, 0};
  const Eigen::LLT<Matrix6d> factor(sum);
  const double of_truth = factor.solve(c.truth.covariance).trace();
  return {factor.matrixL().solve(c.error).squaredNorm(), of_truth / 2};
}

/// The statistic of a chi-square distribution with six degrees of freedom; of those that pick one
/// value its mean.
double consistent_nees(Statistic statistic) {
  switch (statistic) {
    case Statistic::rms:
      return std::sqrt(48.0);
    case Statistic::deviation:
      return std::sqrt(12.0);
    case Statistic::p50:
      return chi_squared_quantile(0.5, 6);
    case Statistic::p90:
      return chi_squared_quantile(0.9, 6);
    case Statistic::p95:
      return chi_squared_quantile(0.95, 6);
    case Statistic::p99:
      return chi_squared_quantile(0.99, 6);
    default:
      return 6;
  }
}

/// The bounds close in on the mean of six as estimates become many.
double consistent_share(Statistic) { return 1; }

struct MeanNees {
  double mean = nan;
  double truth_sigma = 0;
  double lower = nan;  ///< 95 % of means of as many independent consistent estimates are between
  double upper = nan;
  std::int64_t samples = 0;
  std::string text;
};

MeanNees mean_nees(const Measurer& measurer, const Phase& phase) {
  const Series series = estimate_series(nees, measurer, phase);
  MeanNees result;
  result.samples = static_cast<std::int64_t>(series.value.size());
  if (series.value.empty()) {
    result.text = series.without_truth == 0 ? "no samples" : "no truth for any estimate";
    return result;
  }
  const auto n = static_cast<double>(result.samples);
  result.mean = compute(Statistic::mean, series.value);
  result.truth_sigma = uncertainty(Statistic::mean, series.value, series.truth_sigma);
  result.lower = chi_squared_quantile(0.025, 6 * n) / n;
  result.upper = chi_squared_quantile(0.975, 6 * n) / n;
  result.text = "mean NEES " + shown(result.mean) + ", chi-square bounds " + shown(result.lower) +
                " to " + shown(result.upper);
  return result;
}

Measured overconfidence(const Measurer& measurer, const Phase& phase) {
  const MeanNees m = mean_nees(measurer, phase);
  return {m.mean / m.upper, m.truth_sigma / m.upper, m.samples, m.text};
}

Measured underconfidence(const Measurer& measurer, const Phase& phase) {
  const MeanNees m = mean_nees(measurer, phase);
  return {m.lower / m.mean, m.lower / m.mean * m.truth_sigma / m.mean, m.samples, m.text};
}

/// Degree of error of an estimate with status OK: more than five of its own sigmas (truth's
/// included), and more than a practical minimum.
enum class Wrong { no, perhaps, yes };

Wrong part_is_wrong(const Vector3d& error, const Matrix3d& own, const Matrix3d& truth,
                    double counts) {
  const Uncertain size = length_of(error, truth);
  if (!is_covariance(own)) return size.value > counts ? Wrong::yes : Wrong::no;
  const Eigen::LLT<Matrix3d> factor(own + truth);
  const double sigmas = factor.matrixL().solve(error).norm();
  if (sigmas <= 5 || size.value + 2 * size.truth_sigma <= counts) return Wrong::no;
  return size.value - 2 * size.truth_sigma > counts ? Wrong::yes : Wrong::perhaps;
}

/// Share of the good estimates that are wrong without a warning.
Measured silently_wrong(const Measurer& measurer, const Phase& phase) {
  const auto* info = measurer.record().info();
  const double length = info && info->target_length_m > 0 ? info->target_length_m : 3;
  std::int64_t samples = 0;
  double wrong = 0;
  double uncertain = 0;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    ++samples;
    const Wrong position =
        part_is_wrong(c.error.head<3>(), c.estimate.covariance.topLeftCorner<3, 3>(),
                      c.truth.covariance.topLeftCorner<3, 3>(), length / 10);
    const Wrong attitude =
        part_is_wrong(c.error.tail<3>(), c.estimate.covariance.bottomRightCorner<3, 3>(),
                      c.truth.covariance.bottomRightCorner<3, 3>(), radians(10));
    if (position == Wrong::yes || attitude == Wrong::yes) {
      wrong += 1;
    } else if (position == Wrong::perhaps || attitude == Wrong::perhaps) {
      uncertain += 1;
    }
  }
  if (samples == 0) return {nan, 0, 0, "no good estimate that truth brackets"};
  const auto n = static_cast<double>(samples);
  return {(wrong + uncertain / 2) / n, uncertain / 4 / n, samples, ""};
}

}  // namespace

void add_consistency(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("consistency", table);
  const auto number = berth::Dimension::number;
  family.estimates("nees", number, smaller_is_better, nees,
                   "error squared over its covariance; 6 on average when consistent");
  family.best_near(consistent_nees);
  family.number("overconfidence", number, smaller_is_better, overconfidence,
                "mean NEES over its upper chi-square bound (97.5 %); at most 1 when consistent");
  family.best_near(consistent_share);
  family.number("underconfidence", number, smaller_is_better, underconfidence,
                "lower chi-square bound (2.5 %) over mean NEES; at most 1 when consistent");
  family.best_near(consistent_share);
  family.number("silently_wrong", number, smaller_is_better, silently_wrong,
                "share of good estimates off by more than 5 of their own sigmas and more than a "
                "tenth of the target's length or 10 deg");
  family.in_percent();
}

}  // namespace berth::evaluation
