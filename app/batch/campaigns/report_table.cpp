// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/report_table.h"

#include <algorithm>
#include <fstream>

#include "app/batch/campaigns/results.h"
#include "common/core/error.h"

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

TrialTable read_trials(const Manifest& manifest, const std::filesystem::path& trials_file) {
  std::ifstream file(trials_file, std::ios::binary);
  if (!file) throw InputError(trials_file.string() + ": cannot be read");
  TrialTable table(manifest);
  std::string line;
  while (std::getline(file, line)) {
    table.add(result_of_line(line, trials_file.string() + ":" + std::to_string(table.size() + 1)));
  }
  return table;
}

}  // namespace berth::campaigns
