// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/report_charts.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "evaluation/report/axis.h"

namespace berth::campaigns {
namespace {

using report::Chart;
using report::Curve;

constexpr double log_from = 30;  // times: what spreads more is shown on a logarithmic axis

int colour_of(std::size_t series) { return 1 + static_cast<int>(series % 6); }

void choose_log_axis(Chart& chart) {
  double low = INFINITY;
  double high = 0;
  for (const Curve& curve : chart.curves) {
    for (const double y : curve.y) {
      if (!std::isfinite(y)) continue;
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  chart.log_y = low > 0 && high > log_from * low;
}

Estimated in_percent(const Estimated& share) {
  return {100 * share.value, {100 * share.bounds.low, 100 * share.bounds.high}};
}

}  // namespace

double place_on_axis(const Sweep& sweep, double x) { return sweep.logarithmic ? std::log10(x) : x; }

void set_axis(Chart& chart, const Sweep& sweep) {
  constexpr double min_room = 0.06;  // of the axis, for a label
  std::vector<std::pair<double, std::string>> places;
  for (const auto& series : sweep.series) {
    for (const Group& group : series.groups) {
      places.emplace_back(place_on_axis(sweep, group.x), group.label);
    }
  }
  std::sort(places.begin(), places.end());
  const double low = places.front().first;
  const double high = places.back().first;
  const double air = high > low ? 0.06 * (high - low) : 0.5;
  chart.x_range = {low - air, high + air};
  chart.x_unit = sweep.unit;
  if (sweep.numeric && !sweep.logarithmic) return;
  chart.x_unit = "";
  if (sweep.binned) {
    const report::Axis axis{std::pow(10, low), std::pow(10, high), true};
    for (const auto& tick : report::ticks(axis, 6)) {
      chart.x_ticks.emplace_back(std::log10(tick.value), tick.label);
    }
    return;
  }
  for (const auto& [place, label] : places) {
    const bool fits =
        chart.x_ticks.empty() || place - chart.x_ticks.back().first > min_room * (high - low);
    if (fits) chart.x_ticks.emplace_back(place, label);
  }
}

void add_curves(Chart& chart, const Sweep& sweep, const Sweep::Series& series,
                const OfGroup& number, const std::string& name, int colour, bool dashed) {
  Curve line{name, Curve::Style::line, colour};
  Curve dots{"", Curve::Style::dots, colour};
  Curve range{"", Curve::Style::range, colour};
  line.dashed = dashed;
  for (const Group& group : series.groups) {
    const Estimated at = number(group);
    if (!std::isfinite(at.value)) continue;
    const double x = place_on_axis(sweep, group.x);
    line.add(x, at.value);
    dots.add(x, at.value);
    // An end that too few trials leave open is not drawn.
    range.add(x, std::isfinite(at.bounds.low) ? at.bounds.low : at.value,
              std::isfinite(at.bounds.high) ? at.bounds.high : at.value);
  }
  chart.curves.push_back(std::move(range));
  chart.curves.push_back(std::move(line));
  chart.curves.push_back(std::move(dots));
}

Chart success_chart(const Sweep& sweep) {
  Chart chart;
  chart.title = "Passed";
  chart.unit = "%";
  chart.group = sweep.parameter;
  chart.min_span = 2;
  for (std::size_t i = 0; i < sweep.series.size(); ++i) {
    add_curves(
        chart, sweep, sweep.series[i], [](const Group& g) { return in_percent(g.success); },
        sweep.series[i].name, colour_of(i), false);
  }
  set_axis(chart, sweep);
  return chart;
}

Chart measurement_chart(const Sweep& sweep, std::size_t measurement,
                        const MeasurementColumn& column) {
  Chart chart;
  chart.title = column.name;
  chart.unit = column.unit;
  chart.group = sweep.parameter;
  const bool one = sweep.series.size() == 1;
  const auto number = [measurement](Estimated MeasuredGroup::*which) {
    return [=](const Group& g) { return g.measured[measurement].*which; };
  };
  for (std::size_t i = 0; i < sweep.series.size(); ++i) {
    const auto& series = sweep.series[i];
    add_curves(chart, sweep, series, number(&MeasuredGroup::median), one ? "median" : series.name,
               colour_of(i), false);
    add_curves(chart, sweep, series, number(&MeasuredGroup::p95),
               one      ? "95 % are below"
               : i == 0 ? "dashed: 95 % are below"
                        : "",
               one ? 2 : colour_of(i), true);
  }
  choose_log_axis(chart);
  set_axis(chart, sweep);
  return chart;
}

std::string percent_text(const Estimated& share) {
  const auto percent = [](double v) { return report::brief(100 * v, 4); };
  if (!std::isfinite(share.value)) return "-";
  return percent(share.value) + " % [" + percent(share.bounds.low) + ", " +
         percent(share.bounds.high) + "]";
}

}  // namespace berth::campaigns
