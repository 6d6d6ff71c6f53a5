// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "app/batch/campaigns/report_sections.h"

namespace berth::campaigns {
namespace {

using nlohmann::ordered_json;

ordered_json estimated(const Estimated& e) {
  return {{"value", e.value}, {"low", e.bounds.low}, {"high", e.bounds.high}};
}

ordered_json group_json(const ReportView& view, const Group& group) {
  ordered_json measured = ordered_json::object();
  for (std::size_t i = 0; i < group.measured.size(); ++i) {
    const MeasuredGroup& m = group.measured[i];
    measured[view.table.measurements[i].name] = {{"measured", m.measured},
                                                 {"mean", estimated(m.mean)},
                                                 {"median", estimated(m.median)},
                                                 {"p95", estimated(m.p95)}};
  }
  return {{"label", group.label},
          {"trials", group.rows.size()},
          {"passed", group.passed},
          {"success", estimated(group.success)},
          {"measurements", measured}};
}

}  // namespace

ordered_json numbers_of(const ReportView& view) {
  ordered_json units = ordered_json::object();
  for (const MeasurementColumn& column : view.table.measurements) units[column.name] = column.unit;
  ordered_json failures = ordered_json::object();
  for (std::size_t row = 0; row < view.table.size(); ++row) {
    if (view.table.passed(row)) continue;
    const std::string& kind = view.table.failures[view.table.failure[row]];
    ordered_json& count = failures[kind.empty() ? name_of(view.table.outcome[row]) : kind];
    count = (count.is_null() ? 0 : count.get<std::int64_t>()) + 1;
  }
  ordered_json sweeps = ordered_json::array();
  for (const Sweep& sweep : view.sweeps) {
    ordered_json series = ordered_json::array();
    for (const auto& one : sweep.series) {
      ordered_json groups = ordered_json::array();
      for (const Group& group : one.groups) groups.push_back(group_json(view, group));
      series.push_back({{"name", one.name}, {"groups", groups}});
    }
    sweeps.push_back({{"parameter", sweep.parameter}, {"unit", sweep.unit}, {"series", series}});
  }
  return {{"schema", "berth-campaign-report-1"},
          {"name", view.manifest.name},
          {"confidence", 0.95},
          {"units", units},
          {"all", group_json(view, view.all)},
          {"failures", failures},
          {"sweeps", sweeps}};
}

}  // namespace berth::campaigns
