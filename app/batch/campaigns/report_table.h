// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <functional>

#include "app/batch/campaigns/trial.h"

namespace berth::campaigns {

/// A parameter that differs between trials, one number of a list as a column of its own.
struct ParameterColumn {
  std::string name;
  std::string unit;
  bool on_grid = false;
  /// Texts of a grid's values or a choice's; empty where numbers are drawn.
  std::vector<std::string> levels;
  std::vector<std::uint16_t> level;  ///< by trial, where there are levels
  std::vector<double> values;        ///< by trial; NaN: no number
};

struct MeasurementColumn {
  std::string name;
  std::string unit;
  std::vector<double> values;  ///< by trial; NaN: was not measured
};

/// The results of a campaign by columns: a hundred thousand trials in some tens of megabytes.
struct TrialTable {
  std::vector<std::int64_t> index;
  std::vector<Outcome> outcome;
  std::vector<std::uint16_t> failure;  ///< by trial: which of failures
  std::vector<std::string> failures;   ///< the first is "": none
  std::vector<Quaterniond> attitude;   ///< by trial; empty where none was drawn
  std::vector<ParameterColumn> parameters;
  std::vector<MeasurementColumn> measurements;

  explicit TrialTable(const Manifest& manifest);
  void add(const TrialResult& result);

  std::size_t size() const { return index.size(); }
  bool passed(std::size_t row) const { return outcome[row] == Outcome::pass; }

 private:
  /// Where in a result's parameters a column's text is found.
  struct Source {
    std::string parameter;
    std::size_t component = 0;
    bool is_component = false;
    std::size_t axis = 0;  ///< of the grid
  };
  Manifest manifest_;
  std::vector<Source> sources_;  ///< of parameters
};

/// @throws InputError when the file cannot be read or a line is no result.
TrialTable read_trials(const Manifest& manifest, const std::filesystem::path& trials_file);

}  // namespace berth::campaigns
