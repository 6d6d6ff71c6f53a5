// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/series.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace berth::evaluation {
namespace {

constexpr Utime truth_period = 100 * millisecond;

struct Unit {
  const char* name;
  double si;
};

Unit unit_of(berth::Dimension dimension) {
  switch (dimension) {
    case berth::Dimension::length:
      return {"mm", 1e-3};
    case berth::Dimension::angle:
      return {"deg", radians(1.0)};
    case berth::Dimension::speed:
      return {"mm/s", 1e-3};
    case berth::Dimension::angular_speed:
      return {"deg/s", radians(1.0)};
    case berth::Dimension::time:
      return {"s", 1};
    case berth::Dimension::frequency:
      return {"Hz", 1};
    default:
      return {"", 1};
  }
}

}  // namespace

Series estimate_series(OfEstimate value, const Measurer& measurer, const Phase& phase) {
  Series series;
  for (const ComparedEstimate& c : measurer.compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    const Uncertain v = value(c);
    if (!std::isfinite(v.value)) continue;
    series.utime.push_back(c.estimate.utime);
    series.value.push_back(v.value);
    series.truth_sigma.push_back(v.truth_sigma);
  }
  series.without_truth = static_cast<std::size_t>(
      std::count_if(measurer.without_truth().begin(), measurer.without_truth().end(),
                    [&phase](Utime utime) { return phase.contains(utime); }));
  return series;
}

Series truth_series(const std::function<Uncertain(const TruthSample&)>& value,
                    const Measurer& measurer, const Phase& phase) {
  Series series;
  const TruthTrack& track = measurer.record().truth();
  for (const Phase::Stretch& stretch : phase.stretches) {
    const auto samples = track.between(stretch.start, stretch.end);
    Utime slot = std::numeric_limits<Utime>::min();
    for (const TruthSample& sample : samples) {
      if (sample.utime / truth_period == slot && &sample != &samples.back()) continue;
      slot = sample.utime / truth_period;
      const Uncertain v = value(sample);
      series.utime.push_back(sample.utime);
      series.value.push_back(v.value);
      series.truth_sigma.push_back(v.truth_sigma);
    }
  }
  if (track.samples().empty()) series.reason = "there is no ground truth";
  return series;
}

void Family::add(Measurement measurement) {
  const Unit unit = unit_of(measurement.dimension);
  measurement.unit = unit.name;
  measurement.unit_si = unit.si;
  measurement.family = name_;
  measurement.detail = std::exchange(detail_, false);
  table_.push_back(std::move(measurement));
}

void Family::estimates(const char* name, berth::Dimension dimension, Direction direction,
                       OfEstimate value, const char* description) {
  series(
      name, dimension, direction,
      [value](const Measurer& m, const Phase& p) { return estimate_series(value, m, p); },
      description);
}

void Family::series(const char* name, berth::Dimension dimension, Direction direction,
                    std::function<Series(const Measurer&, const Phase&)> series,
                    const char* description) {
  add({name, dimension, "", 1, description, direction, nullptr, std::move(series), nullptr, "",
       false, false});
}

void Family::number(const char* name, berth::Dimension dimension, Direction direction,
                    std::function<Measured(const Measurer&, const Phase&)> number,
                    const char* description) {
  add({name, dimension, "", 1, description, direction, nullptr, nullptr, std::move(number), "",
       false, false});
}

Family& Family::detail() {
  detail_ = true;
  return *this;
}

void Family::in_percent() {
  table_.back().unit = "%";
  table_.back().unit_si = 1e-2;
}

void Family::best_near(double (*ideal)(Statistic)) { table_.back().ideal = ideal; }

void Family::of_returns() { table_.back().of_returns = true; }

void Family::in_milliseconds() {
  table_.back().unit = "ms";
  table_.back().unit_si = 1e-3;
}

}  // namespace berth::evaluation
