// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "app/batch/campaigns/report_sections.h"
#include "common/core/text.h"
#include "evaluation/report/axis.h"

namespace berth::campaigns {
namespace {

using namespace report;
using OfCell = std::function<HeatMap::Cell(const Group&)>;

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

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + ", " + unit;
}

Html table_of(const ReportView& view, const Sweep& sweep) {
  const bool several = sweep.series.size() > 1;
  Table table{several ? "ll" : "l",
              {with_unit(sweep.parameter, sweep.binned ? sweep.unit : ""), "trials", "passed",
               "passed [95 %]"}};
  if (several) table.head.insert(table.head.begin(), "");
  for (const MeasurementColumn& column : view.table.measurements) {
    table.head.push_back(with_unit(column.name + " median", column.unit));
    table.head.push_back("95 % below");
  }
  for (const Sweep::Series& series : sweep.series) {
    for (const Group& group : series.groups) {
      std::vector<Table::Cell> row = {group.label, group.rows.size(), group.passed,
                                      percent_text(group.success)};
      if (several) row.insert(row.begin(), series.name);
      for (const MeasuredGroup& measured : group.measured) {
        row.push_back(brief(measured.median.value, 3));
        row.push_back(brief(measured.p95.value, 3));
      }
      table.rows.push_back(std::move(row));
    }
  }
  return element("details", "", element("summary", "", text("as numbers")) + html_of(table));
}

/// Rows of each place of two parameters of the grid.
std::vector<std::vector<Rows>> places_of(const TrialTable& table, const ParameterColumn& x,
                                         const ParameterColumn& y) {
  std::vector<std::vector<Rows>> places(y.levels.size(), std::vector<Rows>(x.levels.size()));
  for (std::size_t row = 0; row < table.size(); ++row) {
    places[y.level[row]][x.level[row]].push_back(row);
  }
  return places;
}

HeatMap map_of(const std::string& title, const ParameterColumn& x, const ParameterColumn& y,
               const std::vector<std::vector<Group>>& groups, const OfCell& cell) {
  HeatMap map;
  map.title = title;
  map.x_name = x.name;
  map.y_name = y.name;
  map.x_labels = x.levels;
  map.y_labels = y.levels;
  for (const auto& line : groups) {
    map.cells.emplace_back();
    for (const Group& group : line) {
      map.cells.back().push_back(cell(group));
      map.cells.back().back().hover = x.name + " " + x.levels[map.cells.back().size() - 1] + ", " +
                                      y.name + " " + y.levels[map.cells.size() - 1] + ": " +
                                      percent_text(group.success) + " of " +
                                      std::to_string(group.rows.size()) + " passed";
    }
  }
  return map;
}

}  // namespace

double place_on_axis(const Sweep& sweep, double x) { return sweep.logarithmic ? std::log10(x) : x; }

void set_axis(Chart& chart, const Sweep& sweep) {
  constexpr std::size_t letters_of_axis = 50;  // side by side, where charts are narrow
  std::vector<std::pair<double, std::string>> places;
  std::size_t max_letters = 0;
  for (const auto& series : sweep.series) {
    for (const Group& group : series.groups) {
      places.emplace_back(place_on_axis(sweep, group.x), group.label);
      max_letters = std::max(max_letters, group.label.size());
    }
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  const bool slanted = !sweep.numeric && places.size() * (max_letters + 2) > letters_of_axis;
  const double min_room = slanted ? 0.03 : 0.06;  // of the axis, for a label
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
  if (slanted) chart.slanted_letters = max_letters;
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

ColourScale failure_scale() { return {{0, 1, 3, 10, 30, 60}, "% failed"}; }

Html sweep_section(const ReportView& view, const Sweep& sweep) {
  std::vector<Chart> charts = {success_chart(sweep)};
  for (std::size_t i = 0; i < view.table.measurements.size(); ++i) {
    if (view.all.measured[i].measured == 0) continue;
    charts.push_back(measurement_chart(sweep, i, view.table.measurements[i]));
  }
  std::string note = "Upright lines: 95 % intervals (Wilson's of shares, binomial of percentiles).";
  if (sweep.binned) note = "Drawn values, in bins of equally many trials. " + note;
  return grid_of(charts) + element("p", "note-wide", text(note)) + table_of(view, sweep);
}

Html grid_section(const ReportView& view) {
  std::vector<const ParameterColumn*> axes;
  for (const ParameterColumn& column : view.table.parameters) {
    if (column.on_grid) axes.push_back(&column);
  }
  Html html;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    for (std::size_t b = a + 1; b < axes.size(); ++b) {
      // The longer one lies along x.
      const bool turned = axes[a]->levels.size() < axes[b]->levels.size();
      const ParameterColumn& x = turned ? *axes[b] : *axes[a];
      const ParameterColumn& y = turned ? *axes[a] : *axes[b];
      std::vector<std::vector<Group>> groups;
      for (auto& line : places_of(view.table, x, y)) {
        groups.emplace_back();
        for (Rows& rows : line)
          groups.back().push_back(group_of(view.table, "", 0, std::move(rows)));
      }
      html += html_of(map_of("Failed", x, y, groups,
                             [](const Group& g) {
                               const double failed = 100 * (1 - g.success.value);
                               return HeatMap::Cell{failed, brief(failed, 2) + " %", ""};
                             }),
                      failure_scale());
      for (std::size_t i = 0; i < view.table.measurements.size(); ++i) {
        const MeasurementColumn& column = view.table.measurements[i];
        std::vector<double> values;
        for (const auto& line : groups) {
          for (const Group& g : line) values.push_back(g.measured[i].median.value);
        }
        html += html_of(map_of("Median " + column.name, x, y, groups,
                               [i](const Group& g) {
                                 const double median = g.measured[i].median.value;
                                 return HeatMap::Cell{median, brief(median, 3), ""};
                               }),
                        ColourScale::for_values(std::move(values), column.unit));
      }
    }
  }
  return html.empty() ? html : element("div", "grid fill", html);
}

}  // namespace berth::campaigns
