// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"
#include "evaluation/run/outcome.h"

namespace berth::report {
namespace {

const char* class_of_state(std::int8_t state) {
  switch (state) {
    case procedure_step_t::PASSED:
      return "good";
    case procedure_step_t::FAILED:
    case procedure_step_t::ERROR:
    case procedure_step_t::TIMEOUT:
      return "bad";
    case procedure_step_t::RUNNING:
    case procedure_step_t::ABORTED:
      return "unsure";
    default:
      return "grey";
  }
}

Html bar_of(const procedure_step_t& step, Utime begin, Utime end, Utime last, const char* colour) {
  if (step.utime_start == 0 || last <= begin) return {};
  const auto part = [&](Utime t) {
    return static_cast<double>(t - begin) / static_cast<double>(last - begin);
  };
  const std::string style = style_along(part(step.utime_start), part(end));
  return element("div", "track", element("i", {{"class", colour}, {"style", style}}, {}));
}

}  // namespace

Html step_section(const RunView& view) {
  const auto* state = view.record().state();
  if (!state || state->steps.empty()) return {};
  Utime last = state->utime;
  for (const procedure_step_t& step : state->steps) last = std::max(last, step.utime_end);
  HtmlTable table{"llll", {"state", "step", "phase", "", "from, s", "lasted, s"}};
  for (const procedure_step_t& step : state->steps) {
    const char* colour = class_of_state(step.state);
    const Utime end = step.utime_end != 0 ? step.utime_end : state->utime;
    Html what =
        markup("<span style=\"padding-left:" + std::to_string(std::max<int>(0, step.depth)) +
               "em\">") +
        text(step.name) + markup("</span>");
    if (step.attempts > 1) {
      what += element("small", "", text(" " + std::to_string(step.attempts) + " attempts"));
    }
    if (!step.detail.empty()) what += markup("<br>") + element("small", "", text(step.detail));
    const bool ran = step.utime_start != 0;
    table.rows.push_back({element("b", colour, text(evaluation::text_of_step_state(step.state))),
                          what, text(step.phase), bar_of(step, view.start(), end, last, colour),
                          ran ? text(brief(view.at(step.utime_start))) : Html(),
                          ran ? text(brief(seconds(end - step.utime_start))) : Html()});
  }
  return html_of(table);
}

}  // namespace berth::report
