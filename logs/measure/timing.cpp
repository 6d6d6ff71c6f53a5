// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "logs/measure/series.h"

namespace berth::logs {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Series latency(const Measurer& measurer, const Phase& phase) {
  Series series;
  for (const LatencySample& sample : measurer.record().latencies()) {
    if (!phase.contains(sample.utime)) continue;
    series.utime.push_back(sample.utime);
    series.value.push_back(seconds(sample.latency));
    series.truth_sigma.push_back(0);
  }
  if (series.value.empty()) {
    series.reason = "no ESTIMATOR_DIAGNOSTICS with latency_us: this estimator does not tell";
  }
  return series;
}

/// How uncertain truth's own clock is: what its covariance holds more along the motion than where
/// the target moved least.
double truth_clock_variance(const Measurer& measurer, const std::vector<ComparedEstimate>& moving) {
  const auto& samples = measurer.record().truth().samples();
  const auto slowest = std::min_element(
      samples.begin(), samples.end(), [](const TruthSample& a, const TruthSample& b) {
        return a.velocity.linear.squaredNorm() < b.velocity.linear.squaredNorm();
      });
  const Matrix3d at_rest = slowest->covariance.topLeftCorner<3, 3>();
  double variance = 0;
  double weight = 0;
  for (const ComparedEstimate& c : moving) {
    const Vector3d& v = c.truth.velocity.linear;
    const Matrix3d more = c.truth.covariance.topLeftCorner<3, 3>() - at_rest;
    variance += std::max(0.0, v.dot(more * v));
    weight += v.squaredNorm() * v.squaredNorm();
  }
  return variance / weight;
}

/// The time t by which estimates run ahead of truth: the position error is b + v t, where b is a
/// constant offset about which truth's own covariance is all that is known beforehand. So a target
/// that goes to and fro tells the two apart; one that goes steadily leaves b's doubt in t.
Measured time_offset(const Measurer& measurer, const Phase& phase) {
  std::vector<ComparedEstimate> moving;
  Matrix3d of_truth = Matrix3d::Zero();
  double travelled = 0;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    moving.push_back(c);
    of_truth += c.truth.covariance.topLeftCorner<3, 3>();
    travelled += c.truth.velocity.linear.squaredNorm();
  }
  const auto samples = static_cast<std::int64_t>(moving.size());
  if (samples < 3) return {nan, 0, samples, "fewer than three estimates that truth brackets"};
  constexpr double slowest = 1e-3;  // m/s
  if (std::sqrt(travelled / static_cast<double>(samples)) < slowest) {
    return {nan, 0, samples, "the target does not move"};
  }
  of_truth /= static_cast<double>(samples);

  using Vector4d = Eigen::Vector4d;
  using Matrix4d = Eigen::Matrix4d;
  Matrix4d normal = Matrix4d::Zero();
  Vector4d right = Vector4d::Zero();
  for (const ComparedEstimate& c : moving) {
    Eigen::Matrix<double, 3, 4> row;
    row << Matrix3d::Identity(), c.truth.velocity.linear;
    normal += row.transpose() * row;
    right += row.transpose() * c.error.head<3>();
  }
  // The prior's weight needs the scatter, which needs the solution: three rounds settle it.
  const Matrix3d prior = (of_truth + 1e-18 * Matrix3d::Identity()).inverse();
  double scatter = 0;
  Vector4d solution = Vector4d::Zero();
  Matrix4d weighted = normal;
  for (int round = 0; round < 3; ++round) {
    weighted = normal;
    weighted.topLeftCorner<3, 3>() += scatter * prior;
    solution = weighted.ldlt().solve(right);
    double sum = 0;
    for (const ComparedEstimate& c : moving) {
      const Vector3d left =
          c.error.head<3>() - solution.head<3>() - solution(3) * c.truth.velocity.linear;
      sum += left.squaredNorm();
    }
    scatter = std::max(sum / (3 * static_cast<double>(samples) - 4), 1e-18);
  }
  const double fit = scatter * weighted.ldlt().solve(Vector4d::Unit(3))(3);
  const double variance = fit + truth_clock_variance(measurer, moving);
  return {solution(3), std::sqrt(variance), samples, ""};
}

}  // namespace

void add_timing(std::vector<Measurement>& table) {
  Family family("time", table);
  family.series("latency", berth::Dimension::time, latency,
                "from the last return of the scan to when its estimate was published");
  family.in_milliseconds();
  family.number("time_offset", berth::Dimension::time, time_offset,
                "by how much estimates run ahead of truth: position error along the velocity over "
                "the velocity, least squares");
  family.in_milliseconds();
}

}  // namespace berth::logs
