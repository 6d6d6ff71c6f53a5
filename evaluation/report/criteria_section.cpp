// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"
#include "lcmtypes/words.h"

namespace berth::report {
namespace {

/// Value, two sigma of truth about it, and the allowed range, on one scale.
Html scale_of(const criterion_result_t& c) {
  if (!std::isfinite(c.value)) return {};
  std::vector<double> shown_values = {c.lower_limit, c.upper_limit, c.value};
  const double band = std::isfinite(c.uncertainty) ? 2 * c.uncertainty : 0;
  shown_values.push_back(c.value - band);
  shown_values.push_back(c.value + band);
  const bool never_negative = c.value >= 0 && !(c.lower_limit < 0);
  if (never_negative) shown_values.push_back(0);
  Axis axis = axis_for(shown_values, false);
  if (never_negative) axis.low = 0;
  const double low = std::isfinite(c.lower_limit) ? c.lower_limit : axis.low;
  const double high = std::isfinite(c.upper_limit) ? c.upper_limit : axis.high;
  const auto mark = [&axis](const std::string& classes, double from, double to) {
    return element(
        "i", {{"class", classes}, {"style", style_along(axis.fraction(from), axis.fraction(to))}},
        {});
  };
  Html html = mark("allowed", low, high);
  for (const double limit : {c.lower_limit, c.upper_limit}) {
    if (std::isfinite(limit)) html += mark("limit", limit, limit);
  }
  const std::string kind = class_of_result(c.result);
  if (band > 0) html += mark("sigma " + kind, c.value - band, c.value + band);
  html += mark("value " + kind, c.value, c.value);
  return element("div", {{"class", "scale"}, {"role", "img"}, {"aria-label", "value on its scale"}},
                 html);
}

Html margin_of(const criterion_result_t& c) {
  const double m = evaluation::margin(c);
  if (!std::isfinite(m)) return {};
  Html html = text(brief(m));
  const double part = relative_margin(c);
  if (std::isfinite(part)) html += element("small", "", text(" " + brief(100 * part, 2) + " %"));
  return html;
}

}  // namespace

Html limits_of(const criterion_result_t& c) {
  const bool lower = std::isfinite(c.lower_limit);
  const bool upper = std::isfinite(c.upper_limit);
  if (lower && upper) {
    return text(brief(c.lower_limit) + " to " + brief(c.upper_limit));
  }
  if (lower) return text("\xE2\x89\xA5 " + brief(c.lower_limit));
  return upper ? text("\xE2\x89\xA4 " + brief(c.upper_limit)) : Html();
}

Html criteria_section(const RunView& view) {
  const auto& criteria = view.comparison().criteria;
  if (criteria.empty()) return {};
  Table table{"llll",
              {"result", "criterion", "phase", "measurement", "value", "\xC2\xB1 truth, 2\xCF\x83",
               "limits", "margin", "unit", "on its scale"}};
  for (const criterion_result_t& c : criteria) {
    Html name = text(c.name);
    if (!c.reason.empty()) name += markup("<br>") + element("small", "", text(c.reason));
    table.rows.push_back(
        {element("b", class_of_result(c.result), text(words::of_criterion(c.result))), name,
         text(c.phase),
         text(c.measurement) + markup("<br>") +
             element("small", "", text(std::to_string(c.samples) + " samples")),
         text(brief(c.value)), c.uncertainty > 0 ? text(brief(2 * c.uncertainty, 3)) : Html(),
         limits_of(c), margin_of(c), text(c.unit), scale_of(c)});
  }
  Html html = html_of(table);
  const bool unsure = std::any_of(criteria.begin(), criteria.end(), [](const auto& c) {
    return c.result == criterion_result_t::INCONCLUSIVE;
  });
  if (unsure) {
    html += element("p", "note-wide",
                    text("Inconclusive: the value lies within two standard uncertainties of ground "
                         "truth of its limit, or could not be measured, so that the log can "
                         "neither confirm nor deny it (as ISO 14253-1)."));
  }
  return html;
}

Html measurement_section(const RunView& view) {
  Html html;
  for (const evaluation::PhaseTable& phase : view.comparison().phases) {
    if (phase.phase == evaluation::teardown_phase || phase.rows.empty()) continue;
    const bool whole = phase.phase == evaluation::whole_run;
    html += markup(whole ? "<details open><summary>" : "<details><summary>") +
            text(evaluation::heading_of(phase)) + markup("</summary>") +
            html_of(evaluation::phase_table(phase)) + markup("</details>\n");
  }
  return html;
}

}  // namespace berth::report
