// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/report_table.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/batch/campaigns/trial_store.h"
#include "common/core/text.h"

namespace berth::campaigns {
namespace {

/// The texts of "[a, b, c]"; of any other text, itself.
std::vector<std::string> components_of(const std::string& text) {
  if (text.size() < 2 || text.front() != '[' || text.back() != ']') return {text};
  std::vector<std::string> parts;
  std::size_t from = 1;
  while (from < text.size()) {
    const std::size_t to = std::min(text.find(',', from), text.size() - 1);
    const std::size_t begin = text.find_first_not_of(' ', from);
    parts.push_back(begin < to ? text.substr(begin, to - begin) : "");
    from = to + 1;
  }
  return parts;
}

std::string name_of_component(const std::string& parameter, std::size_t index, std::size_t count) {
  constexpr const char* pose[] = {"x", "y", "z", "w", "p", "r"};
  const bool is_pose = count == 6;
  return parameter + " " + (is_pose ? pose[index] : std::to_string(index + 1));
}

double number_of(const std::string& text) {
  const auto quantity = quantity_of(text);
  return quantity ? quantity->value : std::nan("");
}

std::uint16_t place_in(std::vector<std::string>& list, const std::string& text) {
  const auto place = std::find(list.begin(), list.end(), text) - list.begin();
  if (place == static_cast<std::ptrdiff_t>(list.size())) list.push_back(text);
  return static_cast<std::uint16_t>(place);
}

constexpr std::size_t max_series = 6;
constexpr std::size_t max_bins = 12;
constexpr std::size_t min_in_a_bin = 20;

MeasuredGroup measured(const MeasurementColumn& column, const Rows& rows) {
  std::vector<double> values;
  for (const std::size_t row : rows) {
    if (std::isfinite(column.values[row])) values.push_back(column.values[row]);
  }
  MeasuredGroup group;
  group.measured = values.size();
  if (values.empty()) return group;
  group.mean = {mean(values), mean_interval(values)};
  group.median = {median(values), quantile_interval(values, 0.5)};
  group.p95 = {quantile(values, 0.95), quantile_interval(values, 0.95)};
  return group;
}

/// Equally many trials in each, split where values differ.
std::vector<Group> bins(const TrialTable& table, const ParameterColumn& column, Rows rows) {
  rows.erase(std::remove_if(rows.begin(), rows.end(),
                            [&](std::size_t r) { return !std::isfinite(column.values[r]); }),
             rows.end());
  std::stable_sort(rows.begin(), rows.end(), [&](std::size_t a, std::size_t b) {
    return column.values[a] < column.values[b];
  });
  const std::size_t count = std::clamp<std::size_t>(rows.size() / min_in_a_bin, 1, max_bins);
  std::vector<Group> groups;
  std::size_t begin = 0;
  for (std::size_t bin = 1; bin <= count && begin < rows.size(); ++bin) {
    std::size_t end = std::max(begin + 1, bin * rows.size() / count);
    while (end < rows.size() && column.values[rows[end]] == column.values[rows[end - 1]]) ++end;
    Rows inside(rows.begin() + static_cast<std::ptrdiff_t>(begin),
                rows.begin() + static_cast<std::ptrdiff_t>(end));
    const double low = column.values[inside.front()];
    const double high = column.values[inside.back()];
    const double middle = column.values[inside[inside.size() / 2]];
    groups.push_back(group_of(table, shown(low) + " to " + shown(high), middle, std::move(inside)));
    begin = end;
  }
  return groups;
}

std::vector<Group> levels(const TrialTable& table, const ParameterColumn& column, const Rows& rows,
                          bool numeric) {
  std::vector<Rows> by_level(column.levels.size());
  for (const std::size_t row : rows) by_level[column.level[row]].push_back(row);
  std::vector<Group> groups;
  for (std::size_t level = 0; level < by_level.size(); ++level) {
    if (by_level[level].empty()) continue;
    const double x = numeric ? column.values[by_level[level].front()] : static_cast<double>(level);
    groups.push_back(group_of(table, column.levels[level], x, std::move(by_level[level])));
  }
  if (numeric) {
    std::sort(groups.begin(), groups.end(),
              [](const Group& a, const Group& b) { return a.x < b.x; });
  }
  return groups;
}

bool spans_a_decade(const std::vector<Sweep::Series>& series) {
  double low = INFINITY;
  double high = 0;
  for (const auto& one : series) {
    for (const Group& group : one.groups) {
      low = std::min(low, group.x);
      high = std::max(high, group.x);
    }
  }
  return low > 0 && high >= 10 * low;
}

/// The grid's other parameter, when there is one and its values are few.
const ParameterColumn* other_of(const TrialTable& table, const ParameterColumn& column) {
  const ParameterColumn* other = nullptr;
  for (const ParameterColumn& one : table.parameters) {
    if (&one == &column || !one.on_grid) continue;
    if (other != nullptr) return nullptr;
    other = &one;
  }
  return other != nullptr && other->levels.size() <= max_series ? other : nullptr;
}

}  // namespace

TrialTable::TrialTable(const Manifest& manifest) : failures{""}, manifest_(manifest) {
  for (std::size_t axis = 0; axis < manifest.grid.size(); ++axis) {
    const Parameter& parameter = manifest.grid[axis];
    if (parameter.values.size() < 2) continue;
    ParameterColumn column;
    column.name = parameter.name;
    column.on_grid = true;
    column.levels.resize(parameter.values.size());
    parameters.push_back(std::move(column));
    sources_.push_back({parameter.name, 0, false, axis});
  }
  for (const Parameter& parameter : manifest.drawn) {
    std::size_t count = 0;
    for (const Draw& one : parameter.values.front())
      count += one.kind == Draw::Kind::attitude ? 3 : 1;
    std::size_t component = 0;
    for (const Draw& one : parameter.values.front()) {
      const std::size_t here = component;
      component += one.kind == Draw::Kind::attitude ? 3 : 1;
      if (one.kind == Draw::Kind::value || one.kind == Draw::Kind::attitude) continue;
      ParameterColumn column;
      column.name = count > 1 ? name_of_component(parameter.name, here, count) : parameter.name;
      if (one.kind == Draw::Kind::choice) {
        column.levels = one.texts;
      } else {
        column.unit = one.unit;
      }
      parameters.push_back(std::move(column));
      sources_.push_back({parameter.name, here, count > 1, 0});
    }
  }
  for (const KeptMeasurement& kept : manifest.measurements) {
    measurements.push_back({kept.name, kept.unit, {}});
  }
}

void TrialTable::add(const TrialResult& result) {
  index.push_back(result.index);
  outcome.push_back(result.outcome);
  failure.push_back(place_in(failures, result.passed() ? "" : result.failure));
  // Of a campaign all trials have one or none has.
  if (result.attitude && attitude.size() + 1 == index.size()) attitude.push_back(*result.attitude);
  const auto places = manifest_.place_of(result.point);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    ParameterColumn& column = parameters[i];
    const Source& source = sources_[i];
    std::string text;
    for (const auto& [name, value] : result.parameters) {
      if (name == source.parameter) text = value;
    }
    if (source.is_component) {
      const auto parts = components_of(text);
      text = source.component < parts.size() ? parts[source.component] : "";
    }
    if (column.on_grid) {
      column.level.push_back(static_cast<std::uint16_t>(places[source.axis]));
      column.levels[column.level.back()] = text;
    } else if (!column.levels.empty()) {
      column.level.push_back(place_in(column.levels, text));
    }
    column.values.push_back(number_of(text));
    if (column.unit.empty()) {
      if (const auto quantity = quantity_of(text)) column.unit = quantity->unit;
    }
  }
  for (MeasurementColumn& column : measurements) {
    column.values.push_back(result.measurement(column.name));
  }
}

TrialTable read_trials(const Manifest& manifest, const std::filesystem::path& file) {
  TrialTable table(manifest);
  for_each_trial(manifest, file, [&](const TrialResult& trial) { table.add(trial); });
  return table;
}

Rows all_rows(const TrialTable& table) {
  Rows rows(table.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  return rows;
}

Group group_of(const TrialTable& table, std::string label, double x, Rows rows) {
  Group group;
  group.label = std::move(label);
  group.x = x;
  group.rows = std::move(rows);
  for (const std::size_t row : group.rows) group.passed += table.passed(row) ? 1 : 0;
  if (!group.rows.empty()) {
    group.success = {static_cast<double>(group.passed) / static_cast<double>(group.rows.size()),
                     wilson_interval(group.passed, group.rows.size())};
  }
  for (const MeasurementColumn& column : table.measurements) {
    group.measured.push_back(measured(column, group.rows));
  }
  return group;
}

std::vector<Sweep> sweeps_of(const TrialTable& table) {
  std::vector<Sweep> sweeps;
  for (const ParameterColumn& column : table.parameters) {
    Sweep sweep;
    sweep.parameter = column.name;
    sweep.unit = column.unit;
    sweep.binned = column.levels.empty();
    sweep.numeric = std::all_of(column.values.begin(), column.values.end(),
                                [](double v) { return std::isfinite(v); });
    const auto add = [&](const std::string& name, const Rows& rows) {
      auto groups =
          sweep.binned ? bins(table, column, rows) : levels(table, column, rows, sweep.numeric);
      if (!groups.empty()) sweep.series.push_back({name, std::move(groups)});
    };
    if (const ParameterColumn* other = other_of(table, column)) {
      std::vector<Rows> by_other(other->levels.size());
      for (std::size_t row = 0; row < table.size(); ++row)
        by_other[other->level[row]].push_back(row);
      for (std::size_t i = 0; i < by_other.size(); ++i) {
        add(other->name + " " + other->levels[i], by_other[i]);
      }
    } else {
      add("", all_rows(table));
    }
    sweep.logarithmic = sweep.numeric && spans_a_decade(sweep.series);
    if (!sweep.series.empty()) sweeps.push_back(std::move(sweep));
  }
  return sweeps;
}

}  // namespace berth::campaigns
