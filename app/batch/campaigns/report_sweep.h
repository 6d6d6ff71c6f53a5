// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/report_table.h"
#include "common/core/statistics.h"

namespace berth::campaigns {

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
