// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/verdict.h"

#include <algorithm>
#include <cmath>

#include "app/exit_code.h"

namespace berth::nights {

double binomial_tail(std::size_t failed, std::size_t runs, double chance) {
  if (failed == 0) return 1;
  if (chance <= 0) return 0;
  double sum = 0;
  for (std::size_t k = failed; k <= runs; ++k) {
    const auto n = static_cast<double>(runs);
    const auto x = static_cast<double>(k);
    sum += std::exp(std::lgamma(n + 1) - std::lgamma(x + 1) - std::lgamma(n - x + 1) +
                    x * std::log(chance) + (n - x) * std::log1p(-chance));
  }
  return std::min(1.0, sum);
}

bool NightReport::has_regression() const {
  return std::any_of(changes.changes.begin(), changes.changes.end(),
                     [](const FlaggedChange& c) { return c.kind != "better"; });
}

int NightReport::exit_code() const {
  const bool error = night.verdict == "error" || !notification.empty();
  const bool failed = night.verdict == "regression" || night.verdict == "failed";
  return exit_code::worst(error ? exit_code::error : exit_code::passed,
                          failed ? exit_code::failed : exit_code::passed);
}

void judge(const Plan& plan, NightReport& report) {
  bool failed = false;
  bool error = report.archive.failed();
  report.cases.clear();
  for (const Case& of : plan.cases) {
    CaseResult result;
    result.name = of.name;
    result.may_fail = of.may_fail;
    for (const FinishedRun& run : report.runs) {
      if (run.case_name != of.name || run.build != Build::tonight) continue;
      ++result.runs;
      result.simulated_s += run.simulated_s;
      result.cpu_s += run.cpu_s;
      if (run.passed()) {
        ++result.passed;
      } else if (run.outcome == "FAIL" || run.outcome == "INCONCLUSIVE") {
        ++result.failed;
      } else {
        ++result.errors;
      }
    }
    result.p_of_failures = binomial_tail(result.failed, result.runs, of.may_fail);
    result.too_many_failed = result.p_of_failures <= plan.family_wise_alpha;
    failed = failed || result.too_many_failed;
    error = error || result.errors > 0;
    report.cases.push_back(result);
  }
  // as exit codes of runs: without all of its runs a night has no answer
  report.night.verdict = error                     ? "error"
                         : report.has_regression() ? "regression"
                         : failed                  ? "failed"
                                                   : "clean";
}

}  // namespace berth::nights
