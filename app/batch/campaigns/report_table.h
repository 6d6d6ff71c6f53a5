// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <functional>

#include "app/batch/campaigns/trial.h"
#include "common/core/statistics.h"

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

/// From a results.sqlite. @throws InputError when it is missing, or one of another kind.
TrialTable read_trials(const Manifest& manifest, const std::filesystem::path& file);

/// Which rows of a table.
using Rows = std::vector<std::size_t>;
Rows all_rows(const TrialTable& table);

/// A number made of trials, and its 95 % interval; NaN where there were none.
struct Estimated {
  double value = std::nan("");
  Bounds bounds{std::nan(""), std::nan("")};
};

/// One measurement of some trials.
struct MeasuredGroup {
  std::size_t measured = 0;
  Estimated mean, median, p95;
};

/// Trials with about the same value of a parameter.
struct Group {
  std::string label;
  double x = 0;  ///< the value; of a bin its middle trial's; of words their place in the list
  Rows rows;
  std::size_t passed = 0;
  Estimated success;                    ///< share, 0 to 1
  std::vector<MeasuredGroup> measured;  ///< as TrialTable::measurements
};

/// Success and errors over one parameter.
struct Sweep {
  std::string parameter;
  std::string unit;
  bool numeric = true;       ///< x is a value
  bool logarithmic = false;  ///< values spread so that a logarithmic axis shows them better
  bool binned = false;       ///< of drawn values: bins of equally many trials
  struct Series {
    std::string name;  ///< value of the grid's other parameter; empty: all
    std::vector<Group> groups;
  };
  std::vector<Series> series;
};

/// Summary of these trials.
Group group_of(const TrialTable& table, std::string label, double x, Rows rows);

/// One for each parameter that differs. Where a grid has two, one series for each value of the
/// other one, if they are few.
std::vector<Sweep> sweeps_of(const TrialTable& table);

}  // namespace berth::campaigns
