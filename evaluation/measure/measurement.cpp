// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/measurement.h"

#include <cmath>
#include <exception>
#include <limits>

#include "common/core/text.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

Series nothing_measured(const std::string& reason, const Series*) {
  Series series;
  series.reason = reason;
  return series;
}

Measured nothing_measured(const std::string& reason, const Measured*) {
  return {std::numeric_limits<double>::quiet_NaN(), 0, 0, reason};
}

/// A measurement that throws counts as not measured; the others do not depend on it.
template <class Result>
void guard(std::function<Result(const Measurer&, const Phase&)>& measure) {
  if (!measure) return;
  measure = [inner = std::move(measure)](const Measurer& measurer, const Phase& phase) {
    try {
      return inner(measurer, phase);
    } catch (const std::exception& e) {
      return nothing_measured(std::string("could not be measured: ") + e.what(),
                              static_cast<const Result*>(nullptr));
    }
  };
}

std::vector<Measurement> make_measurements() {
  std::vector<Measurement> table;
  add_errors(table);
  add_velocities(table);
  add_consistency(table);
  add_availability(table);
  add_scans(table);
  add_steps(table);
  add_timing(table);
  add_mount(table);
  add_following(table);
  add_approach(table);
  add_safety(table);
  for (Measurement& measurement : table) {
    guard(measurement.series);
    guard(measurement.number);
  }
  return table;
}

/// "smaller", "larger" or "nearer 1"; empty where neither is better.
std::string better_of(const Measurement& measurement) {
  const Preference preference = measurement.preference(Statistic::mean);
  if (preference.direction == Direction::neither) return "";
  if (preference.direction == Direction::larger_is_better) return "larger";
  return preference.ideal == 0 ? "smaller" : "nearer " + fixed(preference.ideal, 0);
}

}  // namespace

const std::vector<Measurement>& measurements() {
  static const std::vector<Measurement> table = make_measurements();
  return table;
}

const Measurement* measurement_named(const std::string& name) {
  for (const Measurement& measurement : measurements()) {
    if (measurement.name == name) return &measurement;
  }
  return nullptr;
}

ChangeKind Preference::kind_of_change(double before, double after) const {
  const bool ratios = ideal > 0 && before > 0 && after > 0;
  const auto worth = [&](double value) {
    if (direction == Direction::larger_is_better) return value;
    return -std::abs(ratios ? std::log(value / ideal) : value - ideal);
  };
  if (direction == Direction::neither || !(worth(before) != worth(after))) {
    return ChangeKind::changed;
  }
  return worth(after) > worth(before) ? ChangeKind::better : ChangeKind::worse;
}

Preference Measurement::preference(Statistic statistic) const {
  const bool scatter = series && statistic == Statistic::deviation;
  if (direction == Direction::larger_is_better && scatter) return {Direction::smaller_is_better, 0};
  return {direction, ideal == nullptr ? 0 : shown(ideal(statistic))};
}

Table measurement_table() {
  Table table{"lllll",
              {keyed("measurement", "name"), "unit", keyed("of", "kind"), "better",
               keyed("what it is", "description"), json_only("family")}};
  for (const Measurement& m : measurements()) {
    table.rows.push_back(
        {m.name, m.unit, m.series ? "series" : "number", better_of(m), m.description, m.family});
  }
  return table;
}

std::string describe_measurements(bool markdown) {
  std::string text;
  const Table all = measurement_table();
  Table table{all.alignment, all.head};
  for (std::size_t i = 0; i < all.rows.size(); ++i) {
    Table::Row& row = table.rows.emplace_back(all.rows[i]);
    if (markdown) row.cells[0] = "`" + row.cells[0].text + "`";
    const std::string& family = row.cells.back().text;
    if (i + 1 < all.rows.size() && all.rows[i + 1].cells.back().text == family) continue;
    text += text.empty() ? "" : "\n";
    text += markdown ? "### " + family + "\n\n" + markdown_table(table)
                     : family + "\n" + text_table(table);
    table.rows.clear();
  }
  if (markdown) return text;
  text += "\nstatistics of a series:";
  for (const std::string& name : statistic_names()) text += " " + name;
  return text + "\n";
}

}  // namespace berth::evaluation
