// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "app/batch/campaigns/report_sections.h"
#include "app/batch/campaigns/sphere_map.h"
#include "common/core/text.h"
#include "common/targets/target.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/view_angles.h"

namespace berth::campaigns {
namespace {

using namespace report;

constexpr std::size_t trials_per_cell = 25;
constexpr std::size_t min_cells = 48;
constexpr std::size_t max_cells = 500;
constexpr std::size_t max_maps = 8;
constexpr double alpha = 0.01;

SphereGrid grid_for(std::size_t trials) {
  return SphereGrid(std::clamp(trials / trials_per_cell, min_cells, max_cells));
}

std::vector<Rows> rows_by_cell(const TrialTable& table, const SphereGrid& grid, const Rows& rows) {
  std::vector<Rows> cells(grid.size());
  for (const std::size_t row : rows) {
    cells[grid.cell_at(viewing_direction(table.attitude[row]))].push_back(row);
  }
  return cells;
}

Vector3d middle_of(const SphereGrid::Cell& cell) {
  const double longitude = (cell.west + cell.east) / 2;
  const double z = (std::sin(cell.south) + std::sin(cell.north)) / 2;
  const double level = std::sqrt(1 - z * z);
  return {level * std::cos(longitude), level * std::sin(longitude), z};
}

std::string hover_of(const SphereGrid::Cell& cell, const Group& group) {
  return name_of_direction(middle_of(cell)) + ": " + percent_text(group.success) + " of " +
         std::to_string(group.rows.size()) + " passed";
}

Html success_map(const TrialTable& table, const std::string& title, const Rows& rows) {
  const SphereGrid grid = grid_for(rows.size());
  SphereMap map{title, {}, {}};
  const auto cells = rows_by_cell(table, grid, rows);
  for (std::size_t i = 0; i < grid.size(); ++i) {
    std::size_t passed = 0;
    for (const std::size_t row : cells[i]) passed += table.passed(row) ? 1 : 0;
    Group group;
    group.rows = cells[i];
    if (!cells[i].empty()) {
      group.success = {static_cast<double>(passed) / static_cast<double>(cells[i].size()),
                       wilson_interval(passed, cells[i].size())};
    }
    map.values.push_back(100 * (1 - group.success.value));
    map.hovers.push_back(hover_of(grid.cell(i), group));
  }
  return picture_of(map, grid, failure_scale());
}

Html number_map(const std::string& title, const std::string& unit, const SphereGrid& grid,
                const std::vector<Rows>& cells, const std::function<double(const Rows&)>& number) {
  SphereMap map{title, {}, {}};
  for (std::size_t i = 0; i < grid.size(); ++i) {
    map.values.push_back(number(cells[i]));
    map.hovers.push_back(name_of_direction(middle_of(grid.cell(i))) + ": " +
                         brief(map.values.back(), 3) + " " + unit + ", " +
                         std::to_string(cells[i].size()) + " trials");
  }
  return picture_of(map, grid, ColourScale::for_values(map.values, unit));
}

double median_of(const MeasurementColumn& column, const Rows& rows) {
  std::vector<double> values;
  for (const std::size_t row : rows) values.push_back(column.values[row]);
  return median(finite(std::move(values)));
}

Html coverage(const TrialTable& table) {
  const SphereGrid grid = grid_for(table.size());
  const auto cells = rows_by_cell(table, grid, all_rows(table));
  Html maps;
  for (const MeasurementColumn& column : table.measurements) {
    if (!maps.code.empty()) break;  // the first map is enough: the numbers hold all
    maps += number_map("Median " + column.name, column.unit, grid, cells,
                       [&](const Rows& rows) { return median_of(column, rows); });
  }
  const double even = static_cast<double>(table.size()) / static_cast<double>(grid.size());
  SphereMap missing{"Coverage: trials less than an even share", {}, {}};
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const auto count = static_cast<double>(cells[i].size());
    missing.values.push_back(std::max(0.0, 100 * (1 - count / even)));
    missing.hovers.push_back(name_of_direction(middle_of(grid.cell(i))) + ": " +
                             std::to_string(cells[i].size()) + " trials, an even share is " +
                             brief(even, 3));
  }
  maps += picture_of(missing, grid, ColourScale({25, 50, 75, 99}, "% less"));
  const auto empty =
      std::count_if(cells.begin(), cells.end(), [](const Rows& r) { return r.empty(); });
  return maps + element("p", "note-wide",
                        text(std::to_string(grid.size()) + " cells of equal area, " +
                             std::to_string(empty) + " of them without a trial."));
}

struct NamedDirection {
  Vector3d on_map;
  std::string caption;
};

/// Pictures of a target from some directions. @throws InputError without its mesh.
Html views_of(const CampaignTarget& seen, const std::vector<NamedDirection>& directions) {
  const Target target = load_target(seen.place, seen.length);
  const RayCaster caster(target.mesh);
  const double away = 2.5 * caster.bounds().size().maxCoeff();
  Html html;
  for (const NamedDirection& one : directions) {
    const Pose pose{{0, 0, away}, upright_attitude(one.on_map)};
    AngleBox box = angles_of(caster.bounds(), pose);
    box.widen(0.04);
    const View view = view_of(box);
    html += element("figure", "scan",
                    element("figcaption", "", text(one.caption)) +
                        svg::image(view.width, view.height, shaded(caster, pose, view)));
  }
  return element("div", "grid fill", html);
}

/// Cells that surely fail most of the trials with a target, and what it looks like from there.
Html worst_views(const ReportView& view, const CampaignTarget& target, const Rows& rows) {
  constexpr std::size_t pictures = 4;
  const SphereGrid grid = grid_for(rows.size());
  const auto cells = rows_by_cell(view.table, grid, rows);
  struct Place {
    std::size_t cell;
    Estimated failed;
  };
  std::vector<Place> places;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const auto failed = static_cast<std::size_t>(
        std::count_if(cells[i].begin(), cells[i].end(),
                      [&](std::size_t row) { return !view.table.passed(row); }));
    if (failed == 0) continue;
    const double share = static_cast<double>(failed) / static_cast<double>(cells[i].size());
    places.push_back({i, {share, wilson_interval(failed, cells[i].size())}});
  }
  std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.failed.bounds.low > b.failed.bounds.low;
  });
  std::vector<NamedDirection> directions;
  for (const Place& place : places) {
    const Vector3d direction = middle_of(grid.cell(place.cell));
    // Neighbours look alike: one picture for each part of the sphere.
    const bool is_near = std::any_of(directions.begin(), directions.end(), [&](const auto& d) {
      return d.on_map.dot(direction) > std::cos(radians(30));
    });
    if (is_near || directions.size() >= pictures) continue;
    directions.push_back({direction, name_of_direction(direction) + ": " +
                                         percent_text(place.failed) + " of " +
                                         std::to_string(cells[place.cell].size()) + " failed"});
  }
  if (directions.empty()) return {};
  const std::string whose = target.name.empty() ? "" : " of " + target.name;
  return element("h3", "", text("Where most fail" + whose + ", and what is seen from there")) +
         views_of(target, directions);
}

/// The same of each target.
Html worst_views(const ReportView& view) {
  const auto& parameters = view.table.parameters;
  const auto axis = std::find_if(parameters.begin(), parameters.end(),
                                 [](const auto& p) { return p.on_grid && p.name == target_axis; });
  if (view.manifest.targets.empty() || axis == parameters.end()) {
    return worst_views(view, view.manifest.target_of({}), all_rows(view.table));
  }
  Html html;
  for (std::size_t i = 0; i < axis->levels.size(); ++i) {
    Rows rows;
    for (std::size_t row = 0; row < view.table.size(); ++row) {
      if (axis->level[row] == i) rows.push_back(row);
    }
    html += worst_views(view, view.manifest.target_of({{target_axis, axis->levels[i]}}), rows);
  }
  return html;
}

Sweep roll_sweep(const TrialTable& table, double& p_value) {
  constexpr std::size_t bins = 12;
  std::vector<Rows> rows(bins);
  for (std::size_t row = 0; row < table.size(); ++row) {
    const double turn = degrees(viewing_roll(table.attitude[row])) / 360 + 0.5;
    rows[std::min(bins - 1, static_cast<std::size_t>(turn * bins))].push_back(row);
  }
  Sweep sweep;
  sweep.parameter = "roll";
  sweep.unit = "deg";
  sweep.series.push_back({"", {}});
  std::vector<std::size_t> passed;
  std::vector<std::size_t> trials;
  for (std::size_t i = 0; i < bins; ++i) {
    const double from = -180 + 30.0 * static_cast<double>(i);
    sweep.series[0].groups.push_back(group_of(table, fixed(from, 0) + " to " + fixed(from + 30, 0),
                                              from + 15, std::move(rows[i])));
    passed.push_back(sweep.series[0].groups.back().passed);
    trials.push_back(sweep.series[0].groups.back().rows.size());
  }
  p_value = p_of_equal_shares(passed, trials);
  return sweep;
}

Html roll_charts(const TrialTable& table) {
  double p_value = 1;
  const Sweep sweep = roll_sweep(table, p_value);
  Chart chart = success_chart(sweep);
  chart.title = "Passed over the roll about the line of sight";
  std::vector<Chart> charts = {chart};
  if (!table.measurements.empty())
    charts.push_back(measurement_chart(sweep, 0, table.measurements[0]));
  const std::string finding =
      p_value < alpha ? "Roll matters: equal shares would differ as much in "
                      : "No evidence that roll matters: equal shares would differ as much in ";
  return grid_of(charts) + element("p", "note-wide",
                                   text(finding + report::brief(100 * p_value, 2) +
                                        " % of campaigns (chi squared)."));
}

}  // namespace

Html attitude_section(const ReportView& view) {
  const TrialTable& table = view.table;
  if (table.attitude.size() != table.size() || table.size() == 0) return {};
  Html maps;
  // A map for each value of the grid's first parameter, if they are few; else one of all.
  const auto first = std::find_if(table.parameters.begin(), table.parameters.end(),
                                  [](const ParameterColumn& p) { return p.on_grid; });
  if (first != table.parameters.end() && first->levels.size() <= max_maps) {
    std::vector<Rows> rows(first->levels.size());
    for (std::size_t row = 0; row < table.size(); ++row) rows[first->level[row]].push_back(row);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      maps += success_map(table, "Failed: " + first->name + " " + first->levels[i], rows[i]);
    }
  } else {
    maps += success_map(table, "Failed", all_rows(table));
  }
  return element("p", "note-wide",
                 text("From where the target was seen, in its model frame: the sphere of "
                      "directions in Hammer's projection, as a globe from outside. In the middle "
                      "the face that looks along −z (the docking interface of the replica), "
                      "+x to the right, −y above; the back at both ends. Equal areas are equal "
                      "shares of all directions; hover shows the number of trials.")) +
         element("div", "grid fill", maps) + element("h3", "", text("All trials")) +
         element("div", "grid fill", coverage(table)) + worst_views(view) +
         element("h3", "", text("Roll")) + roll_charts(table);
}

}  // namespace berth::campaigns
