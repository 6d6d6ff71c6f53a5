// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {
namespace {

struct Times {
  std::vector<double> at;     ///< s
  std::vector<double> value;  ///< in the chart's unit
};

Chart over_time(const RunView& view, const char* title, const char* unit, const Times& times) {
  Chart chart = view.chart(title, unit);
  chart.clip_extremes = true;
  Curve curve;
  curve.style = Curve::Style::dots;
  curve.colour = 1;
  curve.x = times.at;
  curve.y = times.value;
  chart.curves.push_back(curve);
  return chart;
}

Chart histogram(const char* title, const char* unit, const Times& times) {
  constexpr int bins = 40;
  const Axis axis = axis_without_extremes(times.value, false);
  Curve curve;
  curve.style = Curve::Style::bars;
  curve.colour = 1;
  curve.name = "estimates";
  curve.y.assign(bins + 1, 0);
  for (int i = 0; i <= bins; ++i) {
    curve.x.push_back(axis.low + (axis.high - axis.low) * i / bins);
  }
  // The last bar is of all that is longer, too.
  for (const double v : times.value) {
    const int bin = std::clamp(static_cast<int>(axis.fraction(v) * bins), 0, bins - 1);
    ++curve.y[static_cast<std::size_t>(bin)];
  }
  Chart chart;
  chart.title = title;
  chart.x_unit = unit;
  chart.curves.push_back(curve);
  for (const auto& [statistic, name] : {std::pair{evaluation::Statistic::p50, "median"},
                                        std::pair{evaluation::Statistic::p95, "p95"},
                                        std::pair{evaluation::Statistic::peak, "max"}}) {
    const double value = evaluation::compute(statistic, times.value);
    chart.marks.push_back({value, std::string(name) + " " + brief(value) + " " + unit, false});
  }
  return chart;
}

Html pair_of(const RunView& view, const char* title, const char* unit, const Times& times) {
  if (times.value.empty()) return {};
  const auto figure = [&](evaluation::Statistic s) {
    return brief(evaluation::compute(s, times.value));
  };
  const std::string words = std::string(title) + ": median " + figure(evaluation::Statistic::p50) +
                            ", p95 " + figure(evaluation::Statistic::p95) + ", p99 " +
                            figure(evaluation::Statistic::p99) + ", max " +
                            figure(evaluation::Statistic::peak) + " " + unit;
  return grid_of({over_time(view, title, unit, times), histogram(title, unit, times)}) +
         element("p", "note-wide", text(words));
}

Times intervals(const RunView& view) {
  Times times;
  Utime last = 0;
  for (const evaluation::EstimateSample& e : view.record().estimates()) {
    if (!e.ok()) continue;
    if (last != 0) {
      times.at.push_back(view.at(e.utime));
      times.value.push_back(seconds(e.utime - last));
    }
    last = e.utime;
  }
  return times;
}

Times series_of(const RunView& view, const char* measurement) {
  Times times;
  const evaluation::Measurement* found = evaluation::measurement_named(measurement);
  const auto whole = view.record().phase(evaluation::whole_run);
  if (found == nullptr || !found->series || !whole) return times;
  const evaluation::Series series = found->series(view.measurer(), *whole);
  for (std::size_t i = 0; i < series.value.size(); ++i) {
    times.at.push_back(view.at(series.utime[i]));
    times.value.push_back(found->shown(series.value[i]));
  }
  return times;
}

Times work(const RunView& view) {
  Times times;
  for (const WorkTimes& w : view.details().work_times) {
    if (w.total() <= 0) continue;  // the twin's stopwatch stands still
    times.at.push_back(view.at(w.utime));
    times.value.push_back(1e3 * w.total());
  }
  return times;
}

}  // namespace

Html timing_section(const RunView& view) {
  const evaluation::Measurement* latency = evaluation::measurement_named("latency");
  return pair_of(view, "time between good estimates", "s", intervals(view)) +
         pair_of(view, "latency of estimates", latency != nullptr ? latency->unit.c_str() : "",
                 series_of(view, "latency")) +
         pair_of(view, "the estimator's work at one estimate", "ms", work(view));
}

}  // namespace berth::report
