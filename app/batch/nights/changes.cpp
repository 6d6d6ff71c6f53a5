// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/changes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "app/batch/nights/runner.h"
#include "common/core/nan.h"
#include "common/core/statistics.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/measure/paired.h"

namespace berth::nights {
namespace {

using Quantity = std::tuple<std::string, std::string, std::string, std::string>;

/// The values of some runs, run by run; NaN where one has none.
using Columns = std::map<Quantity, std::vector<double>>;

bool completed(const FinishedRun& run) {
  for (const RunValue& v : run.values) {
    if (v.measurement == evaluation::completed_measurement) return v.value != 0;
  }
  return false;
}

/// Extremes and the teardown of a run vary more at random than with a change: recorded, not
/// compared.
bool is_compared(const RunValue& v) {
  return v.statistic != "peak" && v.phase != evaluation::teardown_phase;
}

Columns columns_of(const std::vector<const FinishedRun*>& runs) {
  Columns columns;
  const Quantity passed{"run", evaluation::passed_measurement, "value", ""};
  const Quantity finished{"run", evaluation::completed_measurement, "value", ""};
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const auto put = [&](const Quantity& quantity, double value) {
      auto& column = columns[quantity];
      column.resize(runs.size(), nan);
      column[i] = value;
    };
    put(passed, runs[i]->passed() ? 1 : 0);
    put(finished, completed(*runs[i]) ? 1 : 0);
    if (!completed(*runs[i])) continue;
    for (const RunValue& v : runs[i]->values) {
      if (v.measurement == evaluation::passed_measurement ||
          v.measurement == evaluation::completed_measurement)
        continue;
      if (is_compared(v)) put({v.phase, v.measurement, v.statistic, v.unit}, v.value);
    }
  }
  return columns;
}

bool all_positive(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isnan(v) || v > 0; });
}

/// One quantity of one case, before and after.
struct Comparison {
  std::string case_name;
  Quantity quantity;
  std::vector<double> before;
  std::vector<double> after;
};

/// On the scale on which it is compared: the logarithm of what is always positive.
evaluation::Test test_of(const Comparison& comparison, std::size_t group,
                         const evaluation::MinimumEffect& minimum) {
  evaluation::Test test{group, comparison.before, comparison.after, 0};
  const double reference = std::abs(mean(finite(comparison.before)));
  const double effect = minimum.of(std::get<1>(comparison.quantity), reference);
  if (all_positive(comparison.before) && all_positive(comparison.after)) {
    for (auto* values : {&test.before, &test.after}) {
      for (double& v : *values) v = std::log(v);
    }
    test.min_effect = std::log1p(effect / reference);
  } else {
    test.min_effect = effect;
  }
  return test;
}

/// Difference of the means with its 95 % interval.
void measure_change(const Comparison& comparison, bool paired, FlaggedChange& change) {
  if (paired) {
    const auto d = evaluation::paired_difference(evaluation::Statistic::mean, comparison.before,
                                                 comparison.after);
    std::tie(change.before, change.after, change.low, change.high, change.runs) =
        std::tie(d.before, d.after, d.low, d.high, d.pairs);
    return;
  }
  const std::vector<double> before = finite(comparison.before);
  const std::vector<double> after = finite(comparison.after);
  change.before = mean(before);
  change.after = mean(after);
  // Two means: their standard errors add in square; 1.96 of them either way.
  const double half = 1.96 * std::sqrt(variance(before) / static_cast<double>(before.size()) +
                                       variance(after) / static_cast<double>(after.size()));
  change.low = change.after - change.before - half;
  change.high = change.after - change.before + half;
  change.runs = after.size();
}

struct Way {
  const char* name;
  bool paired;
  const std::vector<FinishedRun>& before;
};

/// The runs of one case: those of before and of after; in pairs of one seed when paired.
struct Runs {
  std::vector<const FinishedRun*> before;
  std::vector<const FinishedRun*> after;
  bool edited = false;
};

std::map<std::string, Runs> runs_of(const Evidence& evidence, const Way& way) {
  std::map<std::string, Runs> cases;
  for (const FinishedRun& after : evidence.tonight) {
    Runs& runs = cases[after.case_name];
    if (after.fresh == way.paired) continue;
    if (!way.paired) {
      runs.after.push_back(&after);
      continue;
    }
    for (const FinishedRun& before : way.before) {
      if (before.case_name != after.case_name || before.seed != after.seed || before.fresh)
        continue;
      if (before.outcome == Outcome::error) continue;  // it measured nothing
      if (before.procedure_hash != after.procedure_hash) {
        runs.edited = true;
        continue;
      }
      runs.before.push_back(&before);
      runs.after.push_back(&after);
    }
  }
  if (way.paired) return cases;
  for (const FinishedRun& before : way.before) {
    const auto found = cases.find(before.case_name);
    if (found == cases.end() || found->second.after.empty() || !before.fresh) continue;
    if (before.procedure_hash != found->second.after.front()->procedure_hash) continue;
    found->second.before.push_back(&before);
  }
  return cases;
}

}  // namespace

ChangeReport find_changes(const Evidence& evidence, double family_wise_alpha,
                          const evaluation::MinimumEffect& minimum,
                          const evaluation::FamilyOptions& options) {
  ChangeReport report;
  std::vector<Way> ways;
  if (!evidence.baseline.empty()) ways.push_back({"baseline", true, evidence.baseline});
  if (!evidence.last_night.empty()) ways.push_back({"last night", true, evidence.last_night});
  if (!evidence.history.empty()) ways.push_back({"history", false, evidence.history});
  if (ways.empty()) report.remarks.push_back("nothing to compare with yet");

  for (const Way& way : ways) {
    std::vector<Comparison> comparisons;
    std::vector<evaluation::Test> tests;
    std::size_t group = 0;
    for (const auto& [name, runs] : runs_of(evidence, way)) {
      if (runs.edited) {
        report.remarks.push_back(name + ": edited since, not compared with the " + way.name);
      }
      if (runs.before.empty() || runs.after.empty()) continue;
      Columns before = columns_of(runs.before);
      for (auto& [quantity, after] : columns_of(runs.after)) {
        const auto found = before.find(quantity);
        if (found == before.end()) continue;
        comparisons.push_back({name, quantity, found->second, after});
        tests.push_back(test_of(comparisons.back(), group, minimum));
      }
      ++group;
    }
    const auto results = way.paired ? evaluation::paired_family(tests, options)
                                    : evaluation::unpaired_family(tests, options);
    const double level = family_wise_alpha / static_cast<double>(ways.size());
    for (std::size_t q = 0; q < comparisons.size(); ++q) {
      if (std::isnan(results[q].change)) continue;
      ++report.comparisons;
      if (results[q].p > level) continue;
      FlaggedChange change;
      change.against = way.name;
      change.case_name = comparisons[q].case_name;
      std::tie(change.phase, change.measurement, change.statistic, change.unit) =
          comparisons[q].quantity;
      measure_change(comparisons[q], way.paired, change);
      change.p = results[q].p;
      const auto criteria = evidence.criteria.find(change.case_name);
      change.kind = name_of(
          kind_of_change(change.measurement, change.statistic, change.before, change.after,
                         criteria == evidence.criteria.end() ? std::vector<evaluation::Criterion>()
                                                             : criteria->second));
      report.changes.push_back(change);
    }
  }
  const auto rank = [](const FlaggedChange& c) {
    return c.kind == "worse" ? 0 : c.kind == "changed" ? 1 : 2;
  };
  std::stable_sort(report.changes.begin(), report.changes.end(),
                   [&](const FlaggedChange& a, const FlaggedChange& b) {
                     return std::make_tuple(rank(a), a.p) < std::make_tuple(rank(b), b.p);
                   });
  return report;
}

}  // namespace berth::nights
