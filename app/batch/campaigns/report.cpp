// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/report.h"

#include <nlohmann/json.hpp>

#include "app/batch/campaigns/report_sections.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"
#include "evaluation/report/html.h"

namespace berth::campaigns {
namespace {

std::string id_of(std::size_t number) { return "parameter-" + std::to_string(number + 1); }

}  // namespace

void write_report(const Manifest& manifest, const std::filesystem::path& directory) {
  const TrialTable table = read_trials(manifest, directory / "trials.jsonl");
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
  sweeps(true);  // seldom what was asked
  section("manifest", "Manifest", manifest_section(view));
  page.write(directory / "report.html");
}

}  // namespace berth::campaigns
