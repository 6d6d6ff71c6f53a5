// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/claims_table.h"

#include <algorithm>

#include "common/core/error.h"
#include "evaluation/measure/statistic.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::nights {
namespace {

using namespace report;

/// Values of a criterion in tonight's runs of a case, in its shown unit.
std::vector<double> values_of(const NightReport& report, const std::string& case_name,
                              const evaluation::Criterion& criterion) {
  std::vector<double> values;
  for (const FinishedRun& run : report.runs) {
    if (run.case_name != case_name || run.build != Build::tonight) continue;
    for (const RunValue& v : run.values) {
      if (v.statistic == criterion.name && v.phase == criterion.phase) values.push_back(v.value);
    }
  }
  return values;
}

void add_rows(const Case& of_plan, const NightReport& report, HtmlTable& table) {
  for (const evaluation::Criterion& c : criteria_of(of_plan)) {
    if (c.claim.empty()) continue;
    const std::vector<double> values = values_of(report, of_plan.name, c);
    const double low = c.measurement->shown(c.lower);
    const double high = c.measurement->shown(c.upper);
    criterion_result_t limits{};
    limits.lower_limit = low;
    limits.upper_limit = high;
    const auto met = std::count_if(values.begin(), values.end(),
                                   [&](double v) { return v >= low && v <= high; });
    const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
    const auto runs = static_cast<std::ptrdiff_t>(values.size());
    table.rows.push_back({text(of_plan.name), text(c.claim),
                          limits_of(limits) + text(" " + c.measurement->unit),
                          text(brief(evaluation::compute(evaluation::Statistic::p50, values))),
                          values.empty() ? Html() : text(brief(*least) + " to " + brief(*greatest)),
                          element("b",
                                  met == runs && runs > 0 ? "good"
                                  : 2 * met >= runs       ? "unsure"
                                                          : "bad",
                                  text(std::to_string(met) + " of " + std::to_string(runs)))});
  }
}

}  // namespace

Html claims_table(const Plan& plan, const NightReport& report) {
  HtmlTable table{
      "ll", {"procedure", "claim", "claimed", "median", "least to greatest", "runs that met it"}};
  for (const Case& of_plan : plan.cases) {
    try {
      add_rows(of_plan, report, table);
    } catch (const InputError& e) {
      table.rows.push_back({text(of_plan.name), text(e.what()), {}, {}, {}, {}});
    }
  }
  return table.rows.empty() ? Html() : html_of(table);
}

}  // namespace berth::nights
