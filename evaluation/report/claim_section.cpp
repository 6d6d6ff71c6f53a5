// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/core/nan.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {
namespace {

const char* text_of_claim(std::int8_t result) {
  if (result == criterion_result_t::PASSED) return "\xE2\x9C\x93 met";
  return result == criterion_result_t::FAILED ? "\xE2\x9C\x97 not met" : "? not decided";
}

Html value_of(const criterion_result_t& c) {
  Html html = element("b", "", text(brief(c.value) + " " + c.unit));
  if (c.uncertainty > 0) {
    html += element("small", "", text(" \xC2\xB1 " + brief(2 * c.uncertainty, 2)));
  }
  return html;
}

Html claim_table(const evaluation::Comparison& comparison) {
  Table table{"lll", {"", "claim", "judged as", "here", "claimed"}};
  for (std::size_t i = 0; i < comparison.criteria.size(); ++i) {
    const criterion_result_t& c = comparison.criteria[i];
    if (comparison.claims[i].empty()) continue;
    table.rows.push_back({element("b", class_of_result(c.result), text(text_of_claim(c.result))),
                          text(comparison.claims[i]), text(c.measurement + " in " + c.phase),
                          value_of(c), limits_of(c) + text(" " + c.unit)});
  }
  return table.rows.empty() ? Html() : html_of(table);
}

constexpr int claim_colour = 0;

using evaluation::FigureChart;

struct Unit {
  std::string name;
  double si;
};

Unit unit_of(const FigureChart& chart) {
  if (const evaluation::Measurement* what = evaluation::measurement_named(chart.draw.front())) {
    return {what->unit, what->unit_si};
  }
  return evaluation::coordinate_named(chart.draw.front()) < 3u ? Unit{"mm", 1e-3}
                                                               : Unit{"deg", radians(1.0)};
}

/// x is the time in the run or the number of the point.
void add(Curve& curve, const FigureChart& figure, const RunView& view, Utime utime, double value) {
  curve.add(figure.by_sample ? static_cast<double>(curve.x.size() + 1) : view.at(utime), value);
}

std::string name_in(const FigureChart& figure, const std::string& run, const std::string& name) {
  return run.empty() ? name : run + (figure.draw.size() > 1 ? " " + name : "");
}

/// One coordinate of estimate and truth, at the times of the estimates.
void draw_coordinate(std::size_t index, const RunView& view, const evaluation::Phase& phase,
                     const FigureChart& figure, Curve& truth, Curve& estimate) {
  for (const evaluation::ComparedEstimate& c : view.measurer().compared()) {
    if (!phase.contains(c.estimate.utime)) continue;
    add(truth, figure, view, c.estimate.utime, xyzwpr_from_pose(c.truth.pose)[index]);
    add(estimate, figure, view, c.estimate.utime, xyzwpr_from_pose(c.estimate.pose)[index]);
  }
}

std::vector<Curve> series_curves(const FigureChart& figure, const RunView& view,
                                 const std::string& run, int colour) {
  const auto phase = view.record().phase(figure.phases.front());
  std::vector<Curve> curves;
  if (!phase) return curves;
  for (const std::string& name : figure.draw) {
    Curve curve{name_in(figure, run, name), Curve::Style::dots, 1 + (colour++ - 1) % 7};
    if (const auto index = evaluation::coordinate_named(name)) {
      Curve truth{"", Curve::Style::line, curve.colour};
      curve.name += ", line: truth";
      draw_coordinate(*index, view, *phase, figure, truth, curve);
      curves.push_back(std::move(truth));
    } else {
      const evaluation::Measurement& what = *evaluation::measurement_named(name);
      const evaluation::Series series = what.series(view.measurer(), *phase);
      for (std::size_t i = 0; i < series.value.size(); ++i) {
        add(curve, figure, view, series.utime[i], what.shown(series.value[i]));
      }
    }
    curves.push_back(std::move(curve));
  }
  return curves;
}

/// One value for each phase, as bars side by side.
std::vector<Curve> phase_curves(const FigureChart& figure, const RunView& view,
                                const std::string& run, std::size_t slot, std::size_t slots) {
  constexpr double room = 0.7;  // of the distance between two phases
  const double width = room / static_cast<double>(slots);
  std::vector<Curve> curves;
  for (const std::string& name : figure.draw) {
    const evaluation::Measurement& what = *evaluation::measurement_named(name);
    Curve curve{name_in(figure, run, name), Curve::Style::bars, static_cast<int>(1 + slot % 7)};
    for (std::size_t i = 0; i < figure.phases.size(); ++i) {
      const auto phase = view.record().phase(figure.phases[i]);
      const double value =
          phase ? view.measurer().measure(what, *figure.statistic, *phase).value : nan;
      const double left = static_cast<double>(i + 1) - room / 2 + static_cast<double>(slot) * width;
      curve.add(left, what.shown(value));
      curve.add(left + width, 0);
    }
    ++slot;
    curves.push_back(std::move(curve));
  }
  return curves;
}

/// The limits of the criteria, drawn over the whole width: each limit once.
void add_claims(const FigureChart& figure, const RunView& view, Chart& chart) {
  for (const criterion_result_t& c : view.comparison().criteria) {
    const auto& names = figure.criteria;
    if (std::find(names.begin(), names.end(), c.name) == names.end()) continue;
    Curve band{"", Curve::Style::band, claim_colour};
    band.x = {(*chart.x_range)[0], (*chart.x_range)[1]};
    const double low = std::isfinite(c.lower_limit) ? c.lower_limit : 0;
    const double high = std::isfinite(c.upper_limit) ? c.upper_limit : low;
    for (const double limit : {c.lower_limit, c.upper_limit}) {
      const auto same = [limit](const Level& level) { return level.y == limit; };
      if (!std::isfinite(limit) || std::any_of(chart.levels.begin(), chart.levels.end(), same)) {
        continue;
      }
      const bool lower = limit == c.lower_limit;
      chart.levels.push_back({limit, (lower ? "claimed: at least " : "claimed: at most ") +
                                         brief(limit) + " " + c.unit});
      if (high > low && (limit == c.upper_limit || !std::isfinite(c.upper_limit))) {
        band.low = {low, low};
        band.y = {high, high};
        chart.curves.insert(chart.curves.begin(), band);
      }
    }
  }
}

/// With the curves of these runs and, as level lines and a band, the limits of the first one's
/// criteria.
Chart chart_of(const FigureChart& figure, const Views& views) {
  Chart chart;
  const Unit unit = unit_of(figure);
  const bool alone = views.size() == 1;
  if (figure.statistic) {
    chart.x_unit = "";
    chart.x_range = {{0.5, static_cast<double>(figure.phases.size()) + 0.5}};
    for (std::size_t i = 0; i < figure.phases.size(); ++i) {
      chart.x_ticks.emplace_back(static_cast<double>(i + 1), figure.phases[i]);
    }
  } else if (figure.by_sample) {
    chart.x_unit = "";
  } else {
    chart = views.front()->chart("", "");
    chart.group = "figures";
  }
  chart.title = figure.title;
  chart.unit = unit.name;
  chart.height_px = 200;
  double last = 1;
  const std::size_t slots = views.size() * figure.draw.size();
  for (std::size_t i = 0; i < views.size(); ++i) {
    const std::string run = alone ? "" : "run " + std::to_string(i + 1);
    auto curves =
        figure.statistic
            ? phase_curves(figure, *views[i], run, i * figure.draw.size(), slots)
            : series_curves(figure, *views[i], run, static_cast<int>(i * figure.draw.size()) + 1);
    for (Curve& curve : curves) {
      if (!curve.x.empty()) last = std::max(last, curve.x.back());
      chart.curves.push_back(std::move(curve));
    }
  }
  if (!chart.x_range) chart.x_range = {{0.5, last + 0.5}};
  for (const auto& [name, si] : figure.levels) chart.levels.push_back({si / unit.si, name});
  add_claims(figure, *views.front(), chart);
  return chart;
}

}  // namespace

Html claims_in_words(const evaluation::Comparison& comparison) {
  std::size_t all = 0;
  std::size_t met = 0;
  for (std::size_t i = 0; i < comparison.claims.size(); ++i) {
    if (comparison.claims[i].empty()) continue;
    ++all;
    if (comparison.criteria[i].result == criterion_result_t::PASSED) ++met;
  }
  if (all == 0) return {};
  return element("b", met == all ? "good" : "bad",
                 text(std::to_string(met) + " of " + std::to_string(all) + " claims met")) +
         text(": " + comparison.source);
}

Html figures_of(const Views& views) {
  Html html;
  for (const evaluation::Figure& figure : views.front()->comparison().figures) {
    std::vector<Chart> charts;
    for (const evaluation::FigureChart& chart : figure.charts)
      charts.push_back(chart_of(chart, views));
    html += element("h3", "", text(figure.name)) + grid_of(charts) +
            element("p", "note-wide", text(figure.caption));
  }
  return html;
}

Html claim_section(const RunView& view) {
  const Html words = claims_in_words(view.comparison());
  Html html = claim_table(view.comparison());
  if (!words.empty()) html = element("p", "", words) + html;
  html += figures_of({&view});
  return html;
}

}  // namespace berth::report
