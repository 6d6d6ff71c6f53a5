// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/latency/estimate_delay.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

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

template <EstimatePose which>
Measured delay(const Measurer& measurer, const Phase& phase) {
  const EstimateDelay found = estimate_delay(measurer, phase, which);
  const auto samples = static_cast<std::int64_t>(found.fit.samples);
  // A criterion counts two sigma; of few samples the interval is wider than that.
  return {found.fit.delay, found.fit.half_width / 2, samples, found.not_observable};
}

}  // namespace

void add_timing(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("time", table);
  family.series("latency", berth::Dimension::time, smaller_is_better, latency,
                "from the last return of the scan to when its estimate was published");
  family.in_milliseconds();
  family.number("lidar_to_arms_delay", berth::Dimension::time, smaller_is_better,
                delay<EstimatePose::measured>,
                "by how much scans are later than the arms' truth says: the poses of single scans "
                "against truth, least squares with truth's constant errors");
  family.in_milliseconds();
  family.number("estimate_delay", berth::Dimension::time, smaller_is_better,
                delay<EstimatePose::filtered>,
                "the same of the filtered estimates: what the filter lags behind is in it");
  family.in_milliseconds();
}

}  // namespace berth::evaluation
