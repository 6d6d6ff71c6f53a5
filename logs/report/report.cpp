// SPDX-License-Identifier: BSD-3-Clause
#include "logs/report/report.h"

#include "logs/report/page.h"
#include "logs/report/sections.h"

namespace berth::report {
namespace {

void add(Page& page, const char* id, const char* heading, const Html& content) {
  if (!content.empty()) page.section(id, heading, content);
}

}  // namespace

void write_report(std::span<const ReportedRun> runs, const std::filesystem::path& file) {
  const RunView view(runs.front());
  Page page(std::string(logs::text_of_outcome(view.comparison().outcome)) + " " +
            view.source().name());
  page.head(verdict_head(view));
  add(page, "criteria", "Criteria", criteria_section(view));
  add(page, "poses", "Estimate and truth", pose_section(view));
  add(page, "errors", "Errors", error_section(view));
  add(page, "scans", "Scans", scan_section(view));
  add(page, "returns", "Residuals and returns", return_section(view));
  add(page, "timing", "Timing", timing_section(view));
  add(page, "steps", "Steps", step_section(view));
  add(page, "events", "Events", event_section(view));
  add(page, "nodes", "Nodes", node_section(view));
  add(page, "measurements", "Measurements", measurement_section(view));
  add(page, "files", "Files", file_section(view, file));
  page.write(file);
}

}  // namespace berth::report
