// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "common/core/utc.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"
#include "evaluation/run/own_estimator.h"
#include "lcmtypes/words.h"

namespace berth::report {
namespace {

/// The criterion of most interest: one that decided, or the one nearest to its limit.
const criterion_result_t* tightest(const std::vector<criterion_result_t>& criteria) {
  const criterion_result_t* worst = nullptr;
  double min_margin = std::numeric_limits<double>::infinity();
  for (const criterion_result_t& c : criteria) {
    const double m = relative_margin(c);
    if (m < min_margin) {
      min_margin = m;
      worst = &c;
    }
  }
  return worst;
}

Html sentence_of(const criterion_result_t& c) {
  const double m = evaluation::margin(c);
  const bool lower = c.value - c.lower_limit < c.upper_limit - c.value;
  Html html = text(m < 0 ? "Worst: " : "Tightest margin: ") + element("b", "", text(c.name)) +
              text(" in " + c.phase + ": " + c.measurement + " " + brief(c.value) + " " + c.unit +
                   (lower ? ", at least " : ", at most ") +
                   brief(lower ? c.lower_limit : c.upper_limit) + " " + c.unit +
                   (m < 0 ? ", beyond by " : ", margin ") + brief(std::abs(m)) + " " + c.unit);
  if (std::isfinite(relative_margin(c))) {
    html += text(" (" + brief(100 * std::abs(relative_margin(c)), 2) + " %)");
  }
  return element("p", "", html);
}

class Facts {
 public:
  void add(const char* name, const std::string& value) {
    if (value.empty()) return;
    list_ += element("div", "", element("dt", "", text(name)) + element("dd", "", text(value)));
  }
  Html html() const { return element("dl", "facts", list_); }

 private:
  Html list_;
};

Html facts_of(const RunView& view) {
  Facts facts;
  const auto* info = view.record().info();
  const bool twin = info && info->host == run_info_t::TWIN;
  facts.add("procedure", view.comparison().procedure);
  if (info) {
    facts.add("host", evaluation::place_of(*info));
    facts.add("layout", info->layout);
    facts.add("target", info->target + ", " + brief(info->target_length_m) + " m");
    facts.add("seed", std::to_string(info->seed));
  }
  facts.add("began",
            twin ? "on the simulated clock" : utc_for_people(view.start(), false) + " UTC");
  facts.add("lasted", brief(view.end_s()) + " s, and its teardown");
  if (info) {
    facts.add("version", info->version);
    facts.add("configuration", info->configuration_hash.substr(0, 12));
    facts.add("estimator", evaluation::own_estimator_of(*info));
  }
  const std::string truth = evaluation::truth_line(view.comparison());
  if (!truth.empty()) facts.add("truth rests on", truth);
  const auto& log = view.comparison().summary;
  facts.add("log", std::to_string(log.events) + " messages" +
                       (log.damaged_bytes + static_cast<std::size_t>(log.missing_events) == 0
                            ? ", undamaged"
                            : ", DAMAGED"));
  return facts.html();
}

}  // namespace

double relative_margin(const criterion_result_t& c) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const bool lower = std::isfinite(c.lower_limit);
  const bool upper = std::isfinite(c.upper_limit);
  if (!std::isfinite(c.value) || (!lower && !upper)) return nan;
  double scale = lower && upper ? 0.5 * (c.upper_limit - c.lower_limit)
                                : std::abs(lower ? c.lower_limit : c.upper_limit);
  if (scale <= 0) scale = std::max(std::abs(c.value), 1e-12);
  return evaluation::margin(c) / scale;
}

const char* class_of_outcome(std::int8_t outcome) {
  if (outcome == procedure_state_t::PASS) return "good";
  if (outcome == procedure_state_t::NONE) return "grey";
  const bool unsure =
      outcome == procedure_state_t::ABORTED || outcome == procedure_state_t::INCONCLUSIVE;
  return unsure ? "unsure" : "bad";
}

const char* class_of_result(std::int8_t result) {
  if (result == criterion_result_t::PASSED) return "good";
  return result == criterion_result_t::FAILED ? "bad" : "unsure";
}

Html verdict_head(const RunView& view) {
  const evaluation::Comparison& c = view.comparison();
  const auto count = [&c](std::int8_t result) {
    return std::to_string(std::count_if(c.criteria.begin(), c.criteria.end(),
                                        [&](const auto& r) { return r.result == result; }));
  };
  Html html = markup("<h1><span class=\"outcome\">") + text(words::of_outcome(c.outcome)) +
              markup("</span> ") + text(view.source().name()) + markup("</h1>");
  if (!c.reason.empty()) html += element("p", "", text(c.reason));
  if (!c.criteria.empty()) {
    html += element(
        "p", "",
        text(count(criterion_result_t::PASSED) + " of " + std::to_string(c.criteria.size()) +
             " criteria passed, " + count(criterion_result_t::FAILED) + " failed, " +
             count(criterion_result_t::INCONCLUSIVE) + " inconclusive. ") +
            (c.agrees ? text("Verdict reproduced from the log: identical.") : Html()));
  }
  const Html claims = claims_in_words(c);
  if (!claims.empty()) html += element("p", "", claims);
  if (const auto* worst = tightest(c.criteria)) html += sentence_of(*worst);
  if (!c.agrees && c.recorded_outcome != procedure_state_t::NONE) {
    html += element("p", "bad",
                    text(std::string("Verdict reproduced from the log: DIFFERENT, recorded was ") +
                         words::of_outcome(c.recorded_outcome) + "."));
  }
  for (const std::string& remark : c.remarks) html += element("p", "unsure", text(remark));
  html += facts_of(view);
  return element("div", (std::string("verdict ") + class_of_outcome(c.outcome)).c_str(), html);
}

}  // namespace berth::report
