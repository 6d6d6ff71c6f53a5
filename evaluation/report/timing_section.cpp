// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "evaluation/latency/latencies.h"
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

namespace {

/// Short, for below a chart: the late side.
std::string tick_of(const std::string& name) {
  if (name == "sensor arm behind replica arm") return "arm to arm";
  return name.substr(0, name.find(" behind"));
}

/// Each delay as a dot in its interval.
Chart intervals(const std::vector<evaluation::Latency>& latencies) {
  Chart chart;
  chart.title = "delays with their 95 % intervals";
  chart.unit = "ms";
  chart.x_unit = "";
  Curve range{"", Curve::Style::range, 1};
  Curve value{"", Curve::Style::dots, 1};
  for (const evaluation::Latency& l : latencies) {
    const bool drawn = std::isfinite(l.value) && std::isfinite(l.low) && std::isfinite(l.high);
    if (l.kind != evaluation::Latency::Kind::delay || !drawn) continue;
    const double x = static_cast<double>(value.x.size());
    chart.x_ticks.emplace_back(x, tick_of(l.name));
    value.add(x, 1e3 * l.value);
    range.add(x, 1e3 * l.low, 1e3 * l.high);
  }
  chart.x_range = {-0.5, static_cast<double>(value.x.size()) - 0.5};
  chart.levels.push_back({0, "no delay"});
  chart.curves = {range, value};
  return chart;
}

/// The direction in which the target went most.
Vector3d main_direction(const std::vector<evaluation::ComparedEstimate>& compared) {
  Matrix3d spread = Matrix3d::Zero();
  for (const auto& c : compared) {
    spread += c.truth.velocity.linear * c.truth.velocity.linear.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors().col(2);
}

/// Error against speed along the main direction: a delay is the slope.
Chart slope(const RunView& view, double delay) {
  const auto& compared = view.measurer().compared();
  const Vector3d along = main_direction(compared);
  Curve dots{"single scans", Curve::Style::dots, 1};
  double mean_error = 0;
  double mean_speed = 0;
  for (const auto& c : compared) {
    if (view.record().steered(c.estimate.utime)) continue;
    const Vector3d error = c.estimate.measured.position - c.truth.pose.position;
    dots.add(1e3 * along.dot(c.truth.velocity.linear), 1e3 * along.dot(error));
    mean_speed += dots.x.back();
    mean_error += dots.y.back();
  }
  Chart chart;
  chart.title = "error along the motion against the speed";
  chart.unit = "mm";
  chart.x_unit = "mm/s";
  chart.clip_extremes = true;
  if (dots.x.empty()) return chart;
  const auto n = static_cast<double>(dots.x.size());
  Curve line{"the delay of " + brief(1e3 * delay, 3) + " ms", Curve::Style::line, 2};
  const auto [min_speed, max_speed] = std::minmax_element(dots.x.begin(), dots.x.end());
  for (const double speed : {*min_speed, *max_speed}) {
    line.add(speed, mean_error / n - delay * (speed - mean_speed / n));
  }
  chart.curves = {dots, line};
  return chart;
}

}  // namespace

Html latency_section(const RunView& view) {
  const auto& latencies = view.comparison().latencies;
  if (latencies.empty()) return {};
  const evaluation::Latency& first = latencies.front();
  Html html;
  std::vector<Chart> charts;
  const Chart delays = intervals(latencies);
  if (!delays.x_ticks.empty()) charts.push_back(delays);
  if (std::isfinite(first.value) && first.remark.empty()) {
    charts.push_back(slope(view, first.value));
  }
  if (!charts.empty()) html += grid_of(charts);
  return html + html_of(evaluation::latency_table(latencies)) +
         element(
             "p", "note-wide",
             text("A positive delay: the first named is later than the second. Of motion: least "
                  "squares with truth's constant errors; intervals from the scatter, or from "
                  "blocks of neighbours drawn again, whichever is wider."));
}

}  // namespace berth::report
