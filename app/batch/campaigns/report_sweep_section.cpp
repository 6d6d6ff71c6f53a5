// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "app/batch/campaigns/report_charts.h"
#include "app/batch/campaigns/report_sections.h"
#include "common/core/text.h"
#include "evaluation/report/axis.h"

namespace berth::campaigns {
namespace {

using namespace report;

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + ", " + unit;
}

Html table_of(const ReportView& view, const Sweep& sweep) {
  const bool several = sweep.series.size() > 1;
  HtmlTable table{several ? "ll" : "l",
                  {with_unit(sweep.parameter, sweep.binned ? sweep.unit : ""), "trials", "passed",
                   "passed [95 %]"}};
  if (several) table.head.insert(table.head.begin(), "");
  for (const MeasurementColumn& column : view.table.measurements) {
    table.head.push_back(with_unit(column.name + " median", column.unit));
    table.head.push_back("95 % below");
  }
  for (const Sweep::Series& series : sweep.series) {
    for (const Group& group : series.groups) {
      std::vector<Html> row;
      if (several) row.push_back(text(series.name));
      row.push_back(text(group.label));
      row.push_back(text(std::to_string(group.rows.size())));
      row.push_back(text(std::to_string(group.passed)));
      row.push_back(text(percent_text(group.success)));
      for (const MeasuredGroup& measured : group.measured) {
        row.push_back(text(brief(measured.median.value, 3)));
        row.push_back(text(brief(measured.p95.value, 3)));
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

using OfCell = std::function<HeatMap::Cell(const Group&)>;

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
