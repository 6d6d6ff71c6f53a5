// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/report.h"

#include "evaluation/report/page.h"
#include "evaluation/report/sections.h"
#include "evaluation/report/side_by_side_sections.h"

namespace berth::report {
namespace {

/// A section that cannot be drawn says why in its place; the others do not depend on it.
template <class Draw>
void add(Page& page, const char* id, const char* heading, Draw draw) {
  Html content;
  try {
    content = draw();
  } catch (const std::exception& e) {
    content = element("p", "bad", text(std::string("cannot be drawn: ") + e.what()));
  }
  if (!content.empty()) page.section(id, heading, content);
}

Page page_of(const ReportedRun& run, const std::filesystem::path& file) {
  const RunView view(run);
  Page page(std::string(evaluation::text_of_outcome(view.comparison().outcome)) + " " +
            view.source().name());
  page.head(verdict_head(view));
  add(page, "claims", "Claims and figures", [&] { return claim_section(view); });
  add(page, "criteria", "Criteria", [&] { return criteria_section(view); });
  add(page, "poses", "Estimate and truth", [&] { return pose_section(view); });
  add(page, "errors", "Errors", [&] { return error_section(view); });
  add(page, "scans", "Scans", [&] { return scan_section(view); });
  add(page, "returns", "Residuals and returns", [&] { return return_section(view); });
  add(page, "timing", "Timing", [&] { return timing_section(view); });
  add(page, "latency", "Latency", [&] { return latency_section(view); });
  add(page, "steps", "Steps", [&] { return step_section(view); });
  add(page, "events", "Events", [&] { return event_section(view); });
  add(page, "nodes", "Nodes", [&] { return node_section(view); });
  add(page, "measurements", "Measurements", [&] { return measurement_section(view); });
  add(page, "files", "Files", [&] { return file_section(view, file); });
  return page;
}

Page page_of(std::span<const ReportedRun> runs, const std::filesystem::path& file) {
  std::vector<RunView> all(runs.begin(), runs.end());
  Views views;
  for (const RunView& view : all) views.push_back(&view);
  Page page(std::to_string(runs.size()) + " runs side by side");
  page.head(beside_head(views, file));
  add(page, "criteria", "Criteria", [&] { return beside_criteria(views); });
  add(page, "figures", "Figures", [&] { return figures_of(views); });
  add(page, "curves", "Errors by phase", [&] { return beside_curves(views); });
  add(page, "poses", "Estimates", [&] { return beside_poses(views); });
  add(page, "measurements", "Measurements", [&] { return beside_measurements(views); });
  return page;
}

}  // namespace

void write_report(std::span<const ReportedRun> runs, const std::filesystem::path& page) {
  (runs.size() == 1 ? page_of(runs.front(), page) : page_of(runs, page)).write(page);
}

}  // namespace berth::report
