// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "evaluation/report/axis.h"
#include "evaluation/report/figure_chart.h"
#include "evaluation/report/sections.h"
#include "evaluation/report/verdict_marks.h"

namespace berth::report {
namespace {

const char* text_of_claim(std::int8_t result) {
  if (result == criterion_result_t::PASSED) return "\xE2\x9C\x93 met";
  return result == criterion_result_t::FAILED ? "\xE2\x9C\x97 not met" : "? not decided";
}

Html value_of(const criterion_result_t& c) {
  Html html = element("b", "", text(brief(c.value) + " " + c.unit));
  if (c.uncertainty > 0) {
    html += element("small", "", text(" \xC2\xB1 " + brief(2 * c.uncertainty, 2)));
  }
  return html;
}

Html claim_table(const evaluation::Comparison& comparison) {
  HtmlTable table{"lll", {"", "claim", "judged as", "here", "claimed"}};
  for (std::size_t i = 0; i < comparison.criteria.size(); ++i) {
    const criterion_result_t& c = comparison.criteria[i];
    if (comparison.claims[i].empty()) continue;
    table.rows.push_back({element("b", class_of_result(c.result), text(text_of_claim(c.result))),
                          text(comparison.claims[i]), text(c.measurement + " in " + c.phase),
                          value_of(c), limits_of(c) + text(" " + c.unit)});
  }
  return table.rows.empty() ? Html() : html_of(table);
}

}  // namespace

Html claims_in_words(const evaluation::Comparison& comparison) {
  std::size_t all = 0;
  std::size_t met = 0;
  for (std::size_t i = 0; i < comparison.claims.size(); ++i) {
    if (comparison.claims[i].empty()) continue;
    ++all;
    if (comparison.criteria[i].result == criterion_result_t::PASSED) ++met;
  }
  if (all == 0) return {};
  return element("b", met == all ? "good" : "bad",
                 text(std::to_string(met) + " of " + std::to_string(all) + " claims met")) +
         text(": " + comparison.source);
}

Html figures_of(const Views& views) {
  Html html;
  for (const evaluation::Figure& figure : views.front()->comparison().figures) {
    std::vector<Chart> charts;
    for (const evaluation::FigureChart& chart : figure.charts)
      charts.push_back(chart_of(chart, views));
    html += element("h3", "", text(figure.name)) + grid_of(charts) +
            element("p", "note-wide", text(figure.caption));
  }
  return html;
}

Html claim_section(const RunView& view) {
  const Html words = claims_in_words(view.comparison());
  Html html = claim_table(view.comparison());
  if (!words.empty()) html = element("p", "", words) + html;
  html += figures_of({&view});
  return html;
}

}  // namespace berth::report
