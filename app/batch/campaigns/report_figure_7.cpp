// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "app/batch/campaigns/report_sections.h"
#include "evaluation/report/axis.h"

namespace berth::campaigns {
namespace {

using namespace report;

/// The paper's text (5.2) on its Figure 7: the number of data sets averaged, the number of points
/// above which errors are "almost constant", and that below which they "significantly increase".
struct Claim {
  std::int64_t data_sets = 110;
  double constant_above = 2000;
  double rising_below = 500;
};

std::size_t measurement_named(const TrialTable& table, const std::string& name) {
  for (std::size_t i = 0; i < table.measurements.size(); ++i) {
    if (table.measurements[i].name == name) return i;
  }
  return table.measurements.size();
}

/// The sweep with its successful trials alone, of which the paper averages.
Sweep of_successes(const TrialTable& table, const Sweep& sweep) {
  Sweep kept = sweep;
  for (auto& series : kept.series) {
    for (Group& group : series.groups) {
      Rows rows;
      for (const std::size_t row : group.rows) {
        if (table.passed(row)) rows.push_back(row);
      }
      group = group_of(table, group.label, group.x, std::move(rows));
    }
  }
  return kept;
}

Chart averages(const Sweep& sweep, const TrialTable& table, const std::string& title,
               const std::vector<std::pair<std::string, std::string>>& quantities,
               const Claim& claim) {
  Chart chart;
  chart.title = title;
  chart.group = "figure 7";
  chart.height_px = 220;
  int colour = 0;
  for (const auto& [name, label] : quantities) {
    const std::size_t m = measurement_named(table, name);
    if (m == table.measurements.size()) continue;
    chart.unit = table.measurements[m].unit;
    ++colour;
    for (const auto& series : sweep.series) {
      const bool first = &series == &sweep.series.front();
      const std::string key = quantities.size() == 1 ? series.name
                              : series.name.empty()  ? label
                                                     : label + ", " + series.name;
      add_curves(
          chart, sweep, series, [m](const Group& g) { return g.measured[m].mean; }, key,
          quantities.size() == 1 ? 1 + static_cast<int>(&series - &sweep.series.front()) : colour,
          !first && quantities.size() > 1);
    }
  }
  set_axis(chart, sweep);
  const auto& range = *chart.x_range;
  const auto at = [&](double x) { return std::clamp(place_on_axis(sweep, x), range[0], range[1]); };
  chart.spans = {{range[0], at(claim.rising_below), "paper: growing", Span::Kind::phase},
                 {at(claim.constant_above), range[1], "paper: even", Span::Kind::phase}};
  chart.y_range = {0, 0};
  for (const Curve& curve : chart.curves) {
    for (const double y : curve.y) (*chart.y_range)[1] = std::max((*chart.y_range)[1], 1.06 * y);
  }
  if (!((*chart.y_range)[1] > 0)) chart.y_range.reset();
  return chart;
}

/// Our averages where the paper states that errors hardly change, and where it states that they
/// grow.
std::string compared(const Sweep& sweep, std::size_t measurement, const Claim& claim) {
  double low = INFINITY;
  double high = 0;
  double few = 0;
  for (const auto& series : sweep.series) {
    for (const Group& group : series.groups) {
      const double mean = group.measured[measurement].mean.value;
      if (!std::isfinite(mean)) continue;
      if (group.x >= claim.constant_above) {
        low = std::min(low, mean);
        high = std::max(high, mean);
      } else if (group.x < claim.rising_below) {
        few = std::max(few, mean);
      }
    }
  }
  if (!(low <= high)) return "not measured there";
  std::string words = brief(low, 3) + " to " + brief(high, 3);
  if (few > 0) words += "; up to " + brief(few, 3) + ", " + brief(few / low, 2) + " times as much";
  return words;
}

}  // namespace

Html figure_7_section(const ReportView& view) {
  if (view.manifest.experiment != "acquisition") return {};
  const auto sweep = std::find_if(view.sweeps.begin(), view.sweeps.end(), [](const Sweep& s) {
    return s.parameter == "returns" && s.numeric && !s.binned;
  });
  if (sweep == view.sweeps.end()) return {};
  const Claim claim;
  const Sweep successes = of_successes(view.table, *sweep);
  std::vector<Chart> charts = {
      averages(successes, view.table, "Average angular error",
               {{"roll_error", "roll"}, {"pitch_error", "pitch"}, {"yaw_error", "yaw"}}, claim),
      averages(successes, view.table, "Average translation error", {{"position_error", ""}},
               claim)};
  std::erase_if(charts, [](const Chart& chart) { return chart.curves.empty(); });
  if (charts.empty()) return {};
  const std::string above = brief(claim.constant_above);
  const std::string below = brief(claim.rising_below);
  Table table{"lll",
              {"average over successful trials", "the paper",
               "here, from " + above + " returns; below " + below}};
  for (const char* name : {"roll_error", "pitch_error", "yaw_error", "position_error"}) {
    const std::size_t m = measurement_named(view.table, name);
    if (m == view.table.measurements.size()) continue;
    table.rows.push_back(
        {text(std::string(name) + ", " + view.table.measurements[m].unit),
         text("almost constant above " + above + ", significantly more below " + below),
         text(compared(successes, m, claim))});
  }
  return grid_of(charts) + html_of(table) +
         element("p", "note-wide",
                 text("The paper resampled " + std::to_string(claim.data_sets) +
                      " data sets at 5 m and averaged over successful runs; its text states where "
                      "the averages are constant and where they grow, its curves are not given as "
                      "numbers. Here every trial is a scan of its own, at an attitude drawn from "
                      "all. Upright lines: 95 % intervals (Student's). Horizontal: returns."));
}

}  // namespace berth::campaigns
