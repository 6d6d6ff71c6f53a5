// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "common/core/nan.h"
#include "evaluation/latency/estimate_delay.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

std::vector<Utime> good_times(const Measurer& measurer, const Phase& phase) {
  std::vector<Utime> times;
  for (const EstimateSample& e : measurer.record().estimates()) {
    if (e.ok() && phase.contains(e.utime)) times.push_back(e.utime);
  }
  return times;
}

Measured update_rate(const Measurer& measurer, const Phase& phase) {
  const auto count = static_cast<std::int64_t>(good_times(measurer, phase).size());
  if (phase.duration_s() <= 0) return {nan, 0, count, "the phase has no duration"};
  return {static_cast<double>(count) / phase.duration_s(), 0, count, ""};
}

Measured tracking_share(const Measurer& measurer, const Phase& phase) {
  const auto& estimates = measurer.record().estimates();
  if (phase.duration_s() <= 0) return {nan, 0, 0, "the phase has no duration"};
  Utime tracked = 0;
  std::int64_t good = 0;
  for (auto e = estimates.begin(); e != estimates.end(); ++e) {
    if (!e->ok()) continue;
    if (phase.contains(e->utime)) ++good;
    Utime until = e->utime + Measurer::estimate_lifetime;
    if (std::next(e) != estimates.end()) until = std::min(until, std::next(e)->utime);
    for (const Phase::Stretch& stretch : phase.stretches) {
      tracked +=
          std::max<Utime>(0, std::min(until, stretch.end) - std::max(e->utime, stretch.start));
    }
  }
  return {seconds(tracked) / phase.duration_s(), 0, good, ""};
}

Measured time_to_acquire(const Measurer& measurer, const Phase& phase) {
  const auto times = good_times(measurer, phase);
  if (times.empty()) return {nan, 0, 0, "no pose was found"};
  return {seconds(times.front() - phase.start()), 0, 1, ""};
}

Measured widest_gap(const Measurer& measurer, const Phase& phase) {
  const auto times = good_times(measurer, phase);
  Utime max_gap = 0;
  for (const Phase::Stretch& stretch : phase.stretches) {
    Utime last = stretch.start;
    auto t = std::lower_bound(times.begin(), times.end(), stretch.start);
    for (; t != times.end() && *t <= stretch.end; ++t) {
      max_gap = std::max(max_gap, *t - last);
      last = *t;
    }
    max_gap = std::max(max_gap, stretch.end - last);
  }
  return {seconds(max_gap), 0, static_cast<std::int64_t>(times.size()), ""};
}

Measured duration(const Measurer&, const Phase& phase) { return {phase.duration_s(), 0, 1, ""}; }

Measured estimate_count(const Measurer& measurer, const Phase& phase) {
  const auto count = static_cast<std::int64_t>(good_times(measurer, phase).size());
  return {static_cast<double>(count), 0, count, ""};
}

}  // namespace

void add_availability(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("availability", table);
  const auto number = berth::Dimension::number;
  const auto time = berth::Dimension::time;
  family.number("update_rate", berth::Dimension::frequency, larger_is_better, update_rate,
                "good estimates per second");
  family.number("tracking_share", number, larger_is_better, tracking_share,
                "share of time with a good estimate not older than 2 s");
  family.in_percent();
  family.number("time_to_acquire", time, smaller_is_better, time_to_acquire,
                "from the start of the phase to the time of its first good estimate");
  family.number("longest_gap", time, smaller_is_better, widest_gap,
                "longest time without a good estimate");
  family.number("duration", time, smaller_is_better, duration, "how long the phase lasted");
  family.number("estimates", number, larger_is_better, estimate_count, "number of good estimates");
}

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
    series.reason = "no ESTIMATOR_DIAGNOSTICS with latency_us: not reported by this estimator";
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
                "delay of scans against the arms' truth: the poses of single scans "
                "against truth, least squares with truth's constant errors");
  family.in_milliseconds();
  family.number("estimate_delay", berth::Dimension::time, smaller_is_better,
                delay<EstimatePose::filtered>,
                "the same of the filtered estimates: what the filter lags behind is in it");
  family.in_milliseconds();
}

}  // namespace berth::evaluation
