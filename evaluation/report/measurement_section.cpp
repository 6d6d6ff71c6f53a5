// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {

Html measurement_section(const RunView& view) {
  Html html;
  for (const evaluation::PhaseTable& phase : view.comparison().phases) {
    if (phase.phase == evaluation::teardown_phase || phase.rows.empty()) continue;
    HtmlTable table{
        "ll", {"measurement", "unit", "samples", "mean", "rms", "p95", "peak", "\u00b1 truth"}};
    for (const evaluation::SeriesRow& row : phase.rows) {
      if (row.measurement->detail) continue;
      table.rows.push_back({text(row.measurement->name), text(row.measurement->unit),
                            text(std::to_string(row.samples)), text(brief(row.mean)),
                            text(brief(row.rms)), text(brief(row.p95)), text(brief(row.peak)),
                            text(brief(row.uncertainty))});
    }
    for (const evaluation::NumberRow& row : phase.numbers) {
      if (row.measurement->detail) continue;
      table.rows.push_back({text(row.measurement->name), text(row.measurement->unit),
                            text(std::to_string(row.samples)), text(brief(row.value)), text(""),
                            text(""), text(""), text(brief(row.uncertainty))});
    }
    const std::string head = phase.phase + ": " + brief(phase.duration_s) + " s, " +
                             std::to_string(phase.estimates) + " good estimates, " +
                             brief(phase.update_rate_hz, 3) + " Hz, tracking " +
                             brief(100 * phase.tracking_share, 3) + " %";
    const bool whole = phase.phase == evaluation::whole_run;
    html += markup(whole ? "<details open><summary>" : "<details><summary>") + text(head) +
            markup("</summary>") + html_of(table) + markup("</details>\n");
  }
  return html;
}

}  // namespace berth::report
