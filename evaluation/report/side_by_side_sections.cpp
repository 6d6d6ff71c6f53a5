// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "evaluation/compare/side_by_side.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"
#include "lcmtypes/words.h"

namespace berth::report {
namespace {

namespace fs = std::filesystem;

std::string number_of(std::size_t i) { return "run " + std::to_string(i + 1); }

Html key_of(std::size_t i) {
  const std::string line = "line c" + std::to_string(1 + i % 7);
  return element("span", "key", element("i", line.c_str(), {}) + text(number_of(i)));
}

Html own_report(const RunView& view, const fs::path& page) {
  const fs::path own = view.source().directory / "report.html";
  if (view.source().directory.empty() || !fs::exists(own)) return text(view.source().name());
  const auto address = fs::absolute(own).lexically_relative(fs::absolute(page).parent_path());
  return link(address.string(), text(view.source().name()));
}

std::string signed_brief(double value) { return (value > 0 ? "+" : "") + brief(value); }

Html difference(double value, double reference) {
  const double d = value - reference;
  if (!std::isfinite(d)) return {};
  if (d == 0) return text("0");
  Html html = text(signed_brief(d));
  if (std::abs(reference) > 0) {
    html +=
        element("small", "",
                text(" " + signed_brief(std::round(1e3 * d / std::abs(reference)) / 10) + " %"));
  }
  return html;
}

Html interval(const std::optional<evaluation::PairedDifference>& p) {
  if (!p || !std::isfinite(p->low)) return {};
  const bool sure = p->low > 0 || p->high < 0;
  return element(sure ? "b" : "span", "",
                 text(signed_brief(p->low) + " to " + signed_brief(p->high)));
}

const criterion_result_t* criterion_of(const RunView& view, const std::string& name) {
  for (const criterion_result_t& c : view.comparison().criteria) {
    if (c.name == name) return &c;
  }
  return nullptr;
}

Curve series_of(const RunView& view, const evaluation::Measurement& what,
                const evaluation::Phase& phase, std::size_t i) {
  Curve curve{number_of(i), Curve::Style::line, static_cast<int>(1 + i % 7)};
  const evaluation::Series series = what.series(view.measurer(), phase);
  auto stretch = phase.stretches.begin();
  for (std::size_t k = 0; k < series.value.size(); ++k) {
    if (stretch != phase.stretches.end() && series.utime[k] > stretch->end) {
      while (stretch != phase.stretches.end() && series.utime[k] > stretch->end) ++stretch;
      // No line across what is not of the phase.
      if (!curve.x.empty()) curve.add(curve.x.back(), std::numeric_limits<double>::quiet_NaN());
    }
    curve.add(seconds(series.utime[k] - phase.start()), what.shown(series.value[k]));
  }
  return curve;
}

}  // namespace

Html compared_head(const Views& views, const fs::path& page) {
  Table table{"lllllllll",
              {"", "verdict", "run", "host", "procedure", "target", "seed", "version",
               "configuration", "lasted, s", "criteria passed"}};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const RunView& view = *views[i];
    const evaluation::Comparison& c = view.comparison();
    const auto* info = view.record().info();
    const auto passed = std::count_if(c.criteria.begin(), c.criteria.end(), [](const auto& r) {
      return r.result == criterion_result_t::PASSED;
    });
    Html verdict = element("b", class_of_outcome(c.outcome), text(words::of_outcome(c.outcome)));
    if (!c.reason.empty()) verdict += markup("<br>") + element("small", "", text(c.reason));
    table.rows.push_back(
        {key_of(i), verdict, own_report(view, page), text(info ? evaluation::place_of(*info) : ""),
         text(c.procedure), text(info ? info->target : ""),
         text(info ? std::to_string(info->seed) : ""), text(info ? info->version : ""),
         element("code", "", text(info ? info->configuration_hash.substr(0, 12) : "")),
         text(brief(view.end_s())),
         text(std::to_string(passed) + " of " + std::to_string(c.criteria.size()))});
  }
  return element("div", "verdict", element("h1", "", text("Runs side by side")) + html_of(table));
}

Html compared_criteria(const Views& views) {
  Table table{"lll", {"criterion", "phase", "measurement", "limits", "unit"}};
  for (std::size_t i = 0; i < views.size(); ++i) table.head.push_back(number_of(i));
  std::vector<std::string> listed;
  for (const RunView* view : views) {
    for (const criterion_result_t& c : view->comparison().criteria) {
      if (std::find(listed.begin(), listed.end(), c.name) != listed.end()) continue;
      listed.push_back(c.name);
      std::vector<Table::Cell> row = {text(c.name), text(c.phase), text(c.measurement),
                                      limits_of(c), text(c.unit)};
      for (const RunView* other : views) {
        const criterion_result_t* same = criterion_of(*other, c.name);
        row.push_back(same == nullptr
                          ? Html()
                          : element("b", class_of_result(same->result),
                                    text(std::string(words::of_criterion(same->result)) + " " +
                                         brief(same->value))));
      }
      table.rows.push_back(row);
    }
  }
  return table.rows.empty() ? Html() : html_of(table);
}

Html compared_curves(const Views& views) {
  std::vector<std::string> phases;
  for (const RunView* view : views) {
    for (const evaluation::Phase& phase : view->phases()) {
      if (std::find(phases.begin(), phases.end(), phase.name) == phases.end()) {
        phases.push_back(phase.name);
      }
    }
  }
  Html html;
  for (const std::string& name : phases) {
    std::vector<Chart> charts;
    for (const char* measurement : {"position_error", "attitude_error"}) {
      const evaluation::Measurement& what = *evaluation::measurement_named(measurement);
      Chart chart;
      chart.title = name + ": " + what.name;
      chart.unit = what.unit;
      chart.group = "phase " + name;
      chart.clip_extremes = true;
      for (std::size_t i = 0; i < views.size(); ++i) {
        const auto phase = views[i]->record().phase(name);
        if (!phase) continue;
        Curve curve = series_of(*views[i], what, *phase, i);
        if (curve.x.size() > 1) chart.curves.push_back(std::move(curve));
      }
      if (!chart.curves.empty()) charts.push_back(std::move(chart));
    }
    if (!charts.empty()) html += grid_of(charts);
  }
  return html;
}

Html compared_poses(const Views& views) {
  constexpr const char* names[] = {"x", "y", "z", "w", "p", "r"};
  std::vector<Chart> charts;
  for (const std::size_t axis : {0u, 3u, 1u, 4u, 2u, 5u}) {
    Chart chart;
    chart.title = names[axis];
    chart.unit = axis < 3 ? "mm" : "deg";
    chart.group = "poses";
    chart.clip_extremes = true;
    for (std::size_t i = 0; i < views.size(); ++i) {
      Curve curve{number_of(i), Curve::Style::dots, static_cast<int>(1 + i % 7)};
      for (const evaluation::EstimateSample& e : views[i]->record().estimates()) {
        if (e.ok()) curve.add(views[i]->at(e.utime), xyzwpr_from_pose(e.pose)[axis]);
      }
      if (!curve.x.empty()) chart.curves.push_back(std::move(curve));
    }
    if (!chart.curves.empty()) charts.push_back(std::move(chart));
  }
  return charts.empty() ? Html() : grid_of(charts);
}

Html compared_measurements(const Views& views) {
  std::vector<const evaluation::Measurer*> measurers;
  for (const RunView* view : views) measurers.push_back(&view->measurer());
  const auto rows = evaluation::compare_side_by_side(measurers);
  Html html;
  for (std::size_t begin = 0; begin < rows.size();) {
    Table table{"ll", {"measurement", "unit"}};
    for (std::size_t i = 0; i < views.size(); ++i) {
      table.head.push_back(number_of(i));
      if (i == 0) continue;
      table.head.push_back("\xE2\x88\x92 run 1");
      table.head.push_back("paired, 95 %");
    }
    const std::string phase = rows[begin].phase;
    for (; begin < rows.size() && rows[begin].phase == phase; ++begin) {
      const evaluation::SideBySideRow& row = rows[begin];
      std::vector<Table::Cell> cells = {text(row.measurement), text(row.unit)};
      for (std::size_t i = 0; i < row.values.size(); ++i) {
        cells.push_back(text(brief(row.values[i])));
        if (i == 0) continue;
        cells.push_back(difference(row.values[i], row.values[0]));
        cells.push_back(interval(row.paired[i]));
      }
      table.rows.push_back(cells);
    }
    html += markup("<details open><summary>") + text(phase) + markup("</summary>") +
            html_of(table) + markup("</details>\n");
  }
  return html +
         element("p", "note-wide",
                 text("Paired: 95 % interval of the difference, bootstrapped over blocks of "
                      "estimates, where both runs estimated at the same times; bold where it "
                      "leaves out zero. Other differences may be random."));
}

}  // namespace berth::report
