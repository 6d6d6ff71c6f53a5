// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "common/core/quantity.h"
#include "common/core/table.h"
#include "evaluation/measure/statistic.h"
#include "evaluation/run/run_record.h"

namespace berth::evaluation {

class Measurer;

/// One quantity over time.
struct Series {
  std::vector<Utime> utime;
  std::vector<double> value;        ///< SI
  std::vector<double> truth_sigma;  ///< 1 sigma of the value, from truth's covariance
  std::size_t without_truth = 0;    ///< samples left out because truth does not bracket them
  std::string reason;               ///< why there are no samples, where that is known
};

/// One number about a phase.
struct Measured {
  double value;            ///< SI; NaN: could not be measured
  double uncertainty = 0;  ///< 1 sigma; see docs/measurements.md for what is in it
  std::int64_t samples = 0;
  std::string reason;  ///< why there is no value, or what else is to be known about it
};

/// Which values of a measurement are the better ones.
enum class Direction { smaller_is_better, larger_is_better, neither };

/// Whether a change is for the better; `changed` where that is undetermined.
enum class ChangeKind { better, worse, changed };

/// The preferred values of a number.
struct Preference {
  Direction direction = Direction::neither;
  /// Where smaller is better: the value whose distance is to be small; 0 of errors, signed or not.
  double ideal = 0;

  /// Of positive numbers with a positive ideal the distance is a ratio: half is as far as double.
  ChangeKind kind_of_change(double before, double after) const;
};

/// A named thing that can be measured on a run: a series of values, of which a statistic is taken,
/// or one number for a phase.
struct Measurement {
  std::string name;
  berth::Dimension dimension;
  std::string unit;  ///< in which it is shown
  double unit_si;    ///< size of that unit
  std::string description;
  Direction direction = Direction::neither;  ///< declared by each; all comparisons go by it alone
  /// Where smaller is better: what a consistent or right value is, in SI; none: 0.
  double (*ideal)(Statistic) = nullptr;
  /// One of the two is set.
  std::function<Series(const Measurer&, const Phase&)> series;
  std::function<Measured(const Measurer&, const Phase&)> number;
  std::string family;       ///< "errors", "velocities" ...: as docs and tables group them
  bool of_returns = false;  ///< needs SCAN_DATA: not foreseen by a rehearsal
  bool detail = false;      ///< left out of tables for people: one axis of what another row shows

  /// In the unit it is shown in.
  double shown(double si) const { return si / unit_si; }
  /// Of a statistic of the series (of a number it is not looked at), in the shown unit. Scatter is
  /// better small, whatever the values are better at.
  Preference preference(Statistic statistic) const;
};

/// Family of measurements that exist only after a fault: a rehearsal cannot predict them.
inline constexpr char safety_family[] = "safety: how faults are answered";

/// All of them, family by family.
const std::vector<Measurement>& measurements();
/// nullptr when there is no such measurement.
const Measurement* measurement_named(const std::string& name);
/// Name, unit, kind, better direction and description of each.
Table measurement_table();
/// The same and the statistics, for people; with Markdown's bars for docs.
std::string describe_measurements(bool markdown = false);

}  // namespace berth::evaluation
