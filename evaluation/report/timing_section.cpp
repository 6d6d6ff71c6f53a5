// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {
namespace {

Chart histogram(const char* title, const char* unit, const std::vector<double>& values) {
  constexpr int bins = 40;
  const Axis axis = axis_without_extremes(values, false);
  Curve curve{"estimates", Curve::Style::bars, 1};
  for (int i = 0; i <= bins; ++i) curve.add(axis.low + (axis.high - axis.low) * i / bins, 0);
  // The last bar is of all that is longer, too.
  for (const double v : values) {
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
    const double value = evaluation::compute(statistic, values);
    chart.marks.push_back({value, std::string(name) + " " + brief(value) + " " + unit, false});
  }
  return chart;
}

Html pair_of(const RunView& view, const char* title, const char* unit, const Curve& dots) {
  if (dots.y.empty()) return {};
  const auto figure = [&](evaluation::Statistic s) {
    return brief(evaluation::compute(s, dots.y));
  };
  Chart over_time = view.chart(title, unit);
  over_time.clip_extremes = true;
  over_time.curves = {dots};
  const std::string words = std::string(title) + ": median " + figure(evaluation::Statistic::p50) +
                            ", p95 " + figure(evaluation::Statistic::p95) + ", p99 " +
                            figure(evaluation::Statistic::p99) + ", max " +
                            figure(evaluation::Statistic::peak) + " " + unit;
  return grid_of({over_time, histogram(title, unit, dots.y)}) +
         element("p", "note-wide", text(words));
}

Curve intervals(const RunView& view) {
  Curve dots{"", Curve::Style::dots, 1};
  Utime last = 0;
  for (const evaluation::EstimateSample& e : view.record().estimates()) {
    if (!e.ok()) continue;
    if (last != 0) dots.add(view.at(e.utime), seconds(e.utime - last));
    last = e.utime;
  }
  return dots;
}

Curve series_of(const RunView& view, const char* measurement) {
  Curve dots{"", Curve::Style::dots, 1};
  const evaluation::Measurement* found = evaluation::measurement_named(measurement);
  const auto whole = view.record().phase(evaluation::whole_run);
  if (found == nullptr || !found->series || !whole) return dots;
  const evaluation::Series series = found->series(view.measurer(), *whole);
  for (std::size_t i = 0; i < series.value.size(); ++i) {
    dots.add(view.at(series.utime[i]), found->shown(series.value[i]));
  }
  return dots;
}

Curve work(const RunView& view) {
  Curve dots{"", Curve::Style::dots, 1};
  for (const WorkTimes& w : view.details().work_times) {
    // The twin's stopwatch stands still.
    if (w.total() > 0) dots.add(view.at(w.utime), 1e3 * w.total());
  }
  return dots;
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
