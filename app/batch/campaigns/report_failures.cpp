// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>

#include "app/batch/campaigns/report_sections.h"
#include "app/batch/campaigns/sphere_map.h"
#include "common/core/text.h"
#include "evaluation/report/axis.h"

namespace berth::campaigns {
namespace {

using namespace report;

constexpr std::size_t max_levels = 24;
constexpr std::size_t max_worst = 12;
constexpr std::size_t max_examples = 4;

std::string kind_of(const TrialTable& table, std::size_t row) {
  const std::string& failure = table.failures[table.failure[row]];
  return failure.empty() ? name_of(table.outcome[row]) : failure;
}

/// "returns 100, range 4.2 m": what was different in a trial.
std::string conditions_of(const TrialTable& table, std::size_t row) {
  std::string words;
  for (const ParameterColumn& column : table.parameters) {
    const std::string value =
        column.levels.empty()
            ? shown(column.values[row]) + (column.unit.empty() ? "" : " " + column.unit)
            : column.levels[column.level[row]];
    words += (words.empty() ? "" : ", ") + column.name + " " + value;
  }
  if (row < table.attitude.size()) {
    words += (words.empty() ? "seen from " : "; seen from ") +
             name_of_direction(viewing_direction(table.attitude[row]));
  }
  return words;
}

/// The trial's number, a link where it has been run again and has something to look at.
Html number_of(const ReportView& view, std::size_t row) {
  const std::string number = std::to_string(view.table.index[row]);
  const std::filesystem::path run = std::filesystem::path(trial_directory) / number;
  for (const char* file : {"report.html", "plot.svg", "result.json", "run.lcm"}) {
    const auto page = run / file;
    if (std::filesystem::exists(view.directory / page)) return link(page.string(), text(number));
  }
  return text(number);
}

std::string again(const ReportView& view, std::size_t row) {
  return "berth campaign trial " + view.directory.string() + " " +
         std::to_string(view.table.index[row]);
}

std::map<std::string, Rows> rows_by_kind(const TrialTable& table) {
  std::map<std::string, Rows> kinds;
  for (std::size_t row = 0; row < table.size(); ++row) {
    if (!table.passed(row)) kinds[kind_of(table, row)].push_back(row);
  }
  return kinds;
}

Html kinds_by_level(const ParameterColumn& column, const std::map<std::string, Rows>& kinds) {
  std::vector<std::size_t> trials(column.levels.size());
  for (const std::uint16_t level : column.level) ++trials[level];
  HeatMap map;
  map.title = "Share of the trials, by " + column.name;
  map.x_name = column.name;
  map.x_labels = column.levels;
  for (const auto& [kind, rows] : kinds) {
    std::vector<std::size_t> failed(column.levels.size());
    for (const std::size_t row : rows) ++failed[column.level[row]];
    map.y_labels.push_back(kind);
    map.cells.emplace_back();
    for (std::size_t i = 0; i < failed.size(); ++i) {
      const double share =
          trials[i] == 0 ? std::nan("")
                         : 100 * static_cast<double>(failed[i]) / static_cast<double>(trials[i]);
      const Estimated estimated{share / 100, wilson_interval(failed[i], trials[i])};
      map.cells.back().push_back({share, brief(share, 2) + " %",
                                  kind + ", " + column.name + " " + column.levels[i] + ": " +
                                      percent_text(estimated) + " of " +
                                      std::to_string(trials[i])});
    }
  }
  return html_of(map, failure_scale());
}

}  // namespace

Html failure_section(const ReportView& view) {
  const TrialTable& table = view.table;
  const auto kinds = rows_by_kind(table);
  if (kinds.empty()) return element("p", "", text("None: all trials passed."));
  std::vector<std::pair<std::string, Rows>> ordered(kinds.begin(), kinds.end());
  std::stable_sort(ordered.begin(), ordered.end(),
                   [](const auto& a, const auto& b) { return a.second.size() > b.second.size(); });
  Table list{"l", {"kind", "trials", "share of all [95 %]", "for example"}};
  for (const auto& [kind, rows] : ordered) {
    const Estimated share{static_cast<double>(rows.size()) / static_cast<double>(table.size()),
                          wilson_interval(rows.size(), table.size())};
    Html examples;
    for (std::size_t i = 0; i < std::min(max_examples, rows.size()); ++i) {
      // Spread over the list, so that not all are of one time.
      const std::size_t row = rows[i * rows.size() / std::min(max_examples, rows.size())];
      examples += (examples.empty() ? Html{} : text(", ")) + number_of(view, row);
    }
    list.rows.push_back(
        {text(kind), text(std::to_string(rows.size())), text(percent_text(share)), examples});
  }
  Html maps;
  for (const ParameterColumn& column : table.parameters) {
    if (column.levels.empty() || column.levels.size() > max_levels) continue;
    maps += kinds_by_level(column, kinds);
  }
  return html_of(list) + (maps.empty() ? Html{} : element("div", "grid fill", maps));
}

Html worst_section(const ReportView& view) {
  const TrialTable& table = view.table;
  Html html;
  for (std::size_t m = 0; m < table.measurements.size(); ++m) {
    const MeasurementColumn& column = table.measurements[m];
    Rows rows;
    for (std::size_t row = 0; row < table.size(); ++row) {
      if (std::isfinite(column.values[row])) rows.push_back(row);
    }
    if (rows.empty()) continue;
    const std::size_t count = std::min(max_worst, rows.size());
    std::partial_sort(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(count), rows.end(),
                      [&](std::size_t a, std::size_t b) {
                        return std::abs(column.values[a]) > std::abs(column.values[b]);
                      });
    rows.resize(count);
    Table list{"llll",
               {"trial", "outcome", "conditions", "runs it again",
                column.name + (column.unit.empty() ? "" : ", " + column.unit)}};
    for (const std::size_t row : rows) {
      list.rows.push_back(
          {number_of(view, row),
           element("b", table.passed(row) ? "good" : "bad", text(kind_of(table, row))),
           text(conditions_of(table, row)), element("code", "", text(again(view, row))),
           text(brief(column.values[row], 4))});
    }
    const Html rest = html_of(list);
    // The first list is open, the others a click away.
    html += html.empty() ? element("h3", "", text("Largest " + column.name)) + rest
                         : element("details", "",
                                   element("summary", "", text("Largest " + column.name)) + rest);
  }
  return html;
}

}  // namespace berth::campaigns
