// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/batch/campaigns/report_sections.h"
#include "app/batch/campaigns/results.h"
#include "common/core/file.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/html.h"

namespace berth::campaigns {
namespace {

using namespace report;
using nlohmann::ordered_json;

Html fact(const std::string& name, const std::string& value) {
  if (value.empty()) return {};
  return markup("<div>") + element("dt", "", text(name)) + element("dd", "", text(value)) +
         markup("</div>");
}

ordered_json json_in(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return ordered_json::object();
  return ordered_json::parse(read_file(file), nullptr, false);
}

/// A number of some digits, in groups of three.
std::string grouped(std::size_t number) {
  std::string digits = std::to_string(number);
  for (auto place = static_cast<std::ptrdiff_t>(digits.size()) - 3; place > 0; place -= 3) {
    digits.insert(static_cast<std::size_t>(place), ",");
  }
  return digits;
}

std::string missing_text(const ordered_json& summary) {
  if (!summary.contains("missing") || summary["missing"].empty()) return "";
  std::int64_t count = 0;
  for (const auto& block : summary["missing"]) {
    count += block.at(1).get<std::int64_t>() - block.at(0).get<std::int64_t>();
  }
  return grouped(static_cast<std::size_t>(count)) + " trials in " +
         std::to_string(summary["missing"].size()) + " blocks: the same command runs them";
}

std::string speed_text(const CampaignCost& cost) {
  if (!(cost.processor_s > 0)) return "";
  std::string words = brief(cost.trials / cost.processor_s, 3) + " trials a second and core";
  if (cost.jobs > 1) {
    words += "; " + brief(cost.fastest, 3) + " with " + std::to_string(cost.jobs) + " workers";
  }
  return words;
}

Html measured_facts(const ReportView& view) {
  Html facts;
  for (std::size_t i = 0; i < view.table.measurements.size(); ++i) {
    const MeasuredGroup& m = view.all.measured[i];
    if (m.measured == 0) continue;
    const MeasurementColumn& column = view.table.measurements[i];
    const std::string unit = column.unit.empty() ? "" : " " + column.unit;
    facts += fact(column.name,
                  brief(m.median.value, 3) + unit + ", 95 % below " + brief(m.p95.value, 3));
  }
  return facts;
}

std::string targets_text(const Manifest& manifest) {
  std::vector<std::string> names;
  for (const CampaignTarget& target : manifest.targets) names.push_back(target.name);
  return names.empty() ? std::filesystem::path(manifest.places.target).filename().string()
                       : joined(names);
}

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

Html campaign_head(const ReportView& view) {
  const ordered_json record = json_in(view.directory / "campaign.json");
  const ordered_json summary = json_in(view.directory / "summary.json");
  const std::string missing = missing_text(summary);
  const std::size_t failed = view.table.size() - view.all.passed;
  const std::string share =
      view.table.size() == 0 ? "-" : brief(100 * view.all.success.value, 4) + " %";
  std::string summary_text = grouped(view.all.passed) + " of " + grouped(view.table.size()) +
                             " trials passed, " + grouped(failed) +
                             " did not: " + percent_text(view.all.success) + " at 95 % confidence.";
  if (!missing.empty()) summary_text += " Missing: " + missing + ".";
  const ordered_json identity = record.value("identity", ordered_json::object());
  const std::string subject = view.manifest.places.procedure.empty()
                                  ? view.manifest.experiment
                                  : view.manifest.places.procedure.filename().string();
  const Html heading = element(
      "h1", "", element("span", "outcome", text(share + " passed")) + text(view.manifest.name));
  const Html facts =
      element("dl", "facts",
              fact("experiment", subject) + fact("target", targets_text(view.manifest)) +
                  fact("points of the grid", std::to_string(view.manifest.points())) +
                  fact("trials at each", std::to_string(view.manifest.trials)) +
                  fact("seed", std::to_string(view.manifest.seed)) + measured_facts(view) +
                  fact("speed", speed_text(campaign_cost(view.directory))) +
                  fact("version", identity.value("berth", "")) +
                  fact("begun", record.value("created", "")));
  Html html = element("div", missing.empty() ? "verdict" : "verdict unsure",
                      heading + element("p", "", text(summary_text)) + facts);
  if (!view.manifest.description.empty()) html += element("p", "", text(view.manifest.description));
  return html;
}

Html manifest_section(const ReportView& view) {
  const ordered_json record = json_in(view.directory / "campaign.json");
  Html rows;
  const ordered_json identity = record.value("identity", ordered_json::object());
  for (const auto& [name, value] : identity.items()) {
    rows += fact(name, value.is_string() ? value.get<std::string>() : json_text(value));
  }
  for (const char* key : {"machine", "compiler", "created"})
    rows += fact(key, record.value(key, ""));
  Html files;
  for (const char* file : {"campaign.yaml", "campaign.json", "results.sqlite", "trials.jsonl",
                           "summary.json", "report.json"}) {
    if (!std::filesystem::exists(view.directory / file)) continue;
    files += (files.empty() ? Html{} : text(" · ")) + link(file, text(file));
  }
  return element("pre", "scroll", text(view.manifest.text)) + element("dl", "facts", rows) +
         element("p", "", files);
}

/// Everything that the charts show, as numbers.
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

std::string id_of(std::size_t number) { return "parameter-" + std::to_string(number + 1); }

}  // namespace

void write_report(const Manifest& manifest, const std::filesystem::path& directory) {
  const TrialTable table = read_trials(manifest, directory / Campaign::results_name);
  const ReportView view{manifest, directory, table, group_of(table, "all", 0, all_rows(table)),
                        sweeps_of(table)};
  write_file(directory / "report.json", json_text(numbers_of(view), 1) + "\n");

  report::Page page(manifest.name + ": campaign");
  page.head(campaign_head(view));
  const auto section = [&page](const std::string& id, const std::string& heading,
                               const report::Html& content) {
    if (!content.empty()) page.section(id, heading, content);
  };
  section("figure-7", "The paper's Figure 7", figure_7_section(view));
  const auto sweeps = [&](bool drawn) {
    for (std::size_t i = 0; i < view.sweeps.size(); ++i) {
      const Sweep& sweep = view.sweeps[i];
      if (sweep.binned != drawn) continue;
      section(id_of(i), "Over " + sweep.parameter, sweep_section(view, sweep));
    }
  };
  sweeps(false);
  section("grid", "Grid", grid_section(view));
  section("attitude", "Attitude", attitude_section(view));
  section("failures", "Failures", failure_section(view));
  section("worst", "Worst trials", worst_section(view));
  sweeps(true);  // seldom of interest
  section("manifest", "Manifest", manifest_section(view));
  page.write(directory / "report.html");
}

}  // namespace berth::campaigns
