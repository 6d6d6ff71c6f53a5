// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "common/core/beam_model.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

Uncertain returns(const ComparedEstimate& c) {
  return {static_cast<double>(c.estimate.returns_used), 0};
}

Series residual(const Measurer& measurer, const Phase& phase) {
  Series series;
  if (!measurer.nearest().rays) {
    series.reason = "the target's surface is not at hand";
    return series;
  }
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    const double rms = measurer.residual(c);
    if (std::isnan(rms)) continue;
    series.utime.push_back(c.estimate.utime);
    series.value.push_back(rms);
    series.truth_sigma.push_back(0);
  }
  if (series.value.empty()) series.reason = "no SCAN_DATA of beams that met the target";
  return series;
}

}  // namespace

double Measurer::residual(const ComparedEstimate& compared) const {
  constexpr std::size_t max_returns = 200;
  const EstimateSample& estimate = compared.estimate;
  const auto [place, is_new] =
      residuals_.try_emplace(estimate.utime, std::numeric_limits<double>::quiet_NaN());
  if (!is_new || !nearest_.rays) return place->second;
  const double reach = 0.1 * nearest_.rays->bounds().size().maxCoeff();
  const std::vector<ScanReturn> returns = record_.returns_of(estimate);
  const std::size_t step = (returns.size() + max_returns - 1) / max_returns;
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < returns.size(); i += step) {
    const ScanReturn& r = returns[i];
    const auto truth = record_.truth().at(r.utime);
    if (!truth) continue;
    const auto range = static_cast<double>(r.range);
    const Vector3d direction =
        beam_direction(static_cast<double>(r.azimuth), static_cast<double>(r.elevation));
    const Pose sensor = truth->pose.inverse();
    RayHit hit;
    const bool met =
        nearest_.rays->cast({sensor.position, sensor.rotation * direction}, range + reach, hit);
    if (!met || hit.range < range - reach) continue;
    const Pose then = moved(estimate.pose, estimate.velocity, seconds(r.utime - estimate.utime));
    const Vector3d point = then.inverse() * Vector3d(range * direction);
    sum += (nearest_.rays->nearest(point) - point).squaredNorm();
    ++count;
  }
  if (count > 0) place->second = std::sqrt(sum / static_cast<double>(count));
  return place->second;
}

void add_scans(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("scans", table);
  family.estimates("returns", berth::Dimension::number, larger_is_better, returns,
                   "returns of its scan that an estimate rests on");
  family.series(
      "residual", berth::Dimension::length, smaller_is_better, residual,
      "rms distance of a scan's returns from the target, by beams that truly met it, from "
      "its surface where the estimate puts it");
  family.of_returns();
}

}  // namespace berth::evaluation
