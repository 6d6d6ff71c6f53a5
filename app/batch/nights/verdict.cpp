// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/verdict.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "app/exit_code.h"
#include "common/core/child_process.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "evaluation/compare/junit.h"

namespace berth::nights {
namespace {

using nlohmann::ordered_json;

std::string sign_of(double value) { return value < 0 ? "" : "+"; }

/// "+10.2 %" where both are above zero, else "+0.31 mm".
std::string change_of(const FlaggedChange& c) {
  const double difference = c.after - c.before;
  if (c.before > 0 && c.after > 0) {
    return sign_of(difference) + fixed(100 * difference / c.before, 1) + " %";
  }
  return sign_of(difference) + shown(difference) + " " + c.unit;
}

std::string name_of(const FlaggedChange& c) {
  return c.case_name + ", " + c.phase + ": " + c.measurement + " (" + c.statistic + ")";
}

std::string sentence_of(const FlaggedChange& c) {
  return c.kind + " than the " + c.against + ": " + shown(c.before) + " -> " + shown(c.after) +
         " " + c.unit + ", " + change_of(c) + ", p = " + p_value_text(c.p);
}

std::string changes_table(const std::vector<FlaggedChange>& changes, std::size_t max_rows) {
  Table table{"lllll",
              {"change", "against", "case", "phase", "measurement", "before", "after", "unit",
               "change", "p-value"}};
  for (const FlaggedChange& c : changes) {
    if (table.rows.size() == max_rows) break;
    table.rows.push_back({c.kind, c.against, c.case_name, c.phase,
                          c.measurement + " " + c.statistic, shown(c.before), shown(c.after),
                          c.unit, change_of(c), p_value_text(c.p)});
  }
  std::string text = text_table(table);
  if (changes.size() > max_rows) {
    text += "  and " + std::to_string(changes.size() - max_rows) + " more: see index.html\n";
  }
  return text;
}

std::string cases_table(const std::vector<CaseResult>& cases) {
  Table table{
      "ll", {"case", "result", "runs", "passed", "failed", "errors", "simulated s", "x real time"}};
  for (const CaseResult& c : cases) {
    const char* result = c.too_many_failed ? "FAIL" : c.errors > 0 ? "ERROR" : "ok";
    table.rows.push_back({c.name, result, std::to_string(c.runs), std::to_string(c.passed),
                          std::to_string(c.failed), std::to_string(c.errors),
                          fixed(c.simulated_s, 0),
                          c.cpu_s > 0 ? fixed(c.simulated_s / c.cpu_s, 0) : "-"});
  }
  return text_table(table);
}

std::string archive_text(const ArchiveResult& archive) {
  if (archive.runs.empty()) return "";
  Table table{"ll", {"recorded run", "against truth", "estimates", "as recorded"}};
  for (const ArchivedRun& run : archive.runs) {
    table.rows.push_back({run.name, run.error.empty() ? run.verdict : "ERROR: " + run.error,
                          std::to_string(run.estimates), std::to_string(run.same)});
  }
  return "\narchive, estimated again: " + std::to_string(archive.runs.size()) + " runs, " +
         std::to_string(archive.changes.size()) + " changes\n" + text_table(table) +
         (archive.changes.empty() ? "" : "\n" + changes_table(archive.changes, 20));
}

ordered_json json_of(const FlaggedChange& c) {
  return {{"kind", c.kind},          {"against", c.against},         {"case", c.case_name},
          {"phase", c.phase},        {"measurement", c.measurement}, {"statistic", c.statistic},
          {"unit", c.unit},          {"before", c.before},           {"after", c.after},
          {"difference_low", c.low}, {"difference_high", c.high},    {"chance", c.p},
          {"runs", c.runs}};
}

ordered_json json_of(const ArchiveResult& archive) {
  ordered_json runs = ordered_json::array();
  for (const ArchivedRun& r : archive.runs) {
    runs.push_back({{"run", r.name},
                    {"error", r.error},
                    {"verdict", r.verdict},
                    {"estimates", r.estimates},
                    {"estimates_same", r.same}});
  }
  ordered_json changes = ordered_json::array();
  for (const FlaggedChange& c : archive.changes) changes.push_back(json_of(c));
  return {{"runs", runs}, {"changes", changes}};
}

}  // namespace

double binomial_tail(std::size_t failed, std::size_t runs, double probability) {
  if (failed == 0) return 1;
  if (probability <= 0) return 0;
  double sum = 0;
  for (std::size_t k = failed; k <= runs; ++k) {
    const auto n = static_cast<double>(runs);
    const auto x = static_cast<double>(k);
    sum += std::exp(std::lgamma(n + 1) - std::lgamma(x + 1) - std::lgamma(n - x + 1) +
                    x * std::log(probability) + (n - x) * std::log1p(-probability));
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
      } else if (run.failed()) {
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

std::string p_value_text(double p) { return fixed(p, 5); }

std::string text_of(const NightReport& report) {
  const Night& night = report.night;
  std::string verdict = night.verdict;
  for (char& c : verdict) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  std::string text =
      "night " + night.name + " (number " + std::to_string(night.number) + "): " + verdict + "\n";
  const auto line = [&](const char* what, const std::string& now, const std::string& then) {
    text += std::string("  ") + what + now;
    if (report.previous && then != now) text += "  (the night before: " + then + ")";
    text += "\n";
  };
  line("version        ", night.version, report.previous ? report.previous->version : "");
  line("configuration  ", night.configuration_hash.substr(0, 12),
       report.previous ? report.previous->configuration_hash.substr(0, 12) : "");
  if (!night.baseline.empty()) text += "  baseline       " + night.baseline + "\n";
  text += "\n" + cases_table(report.cases);

  bool heading = false;
  for (const FinishedRun& run : report.runs) {
    if (run.passed() || run.build != Build::tonight) continue;
    if (!heading) text += "\nruns that did not pass\n";
    heading = true;
    text += std::string("  ") + name_of(run.outcome) + "  " + run.case_name + " seed " +
            std::to_string(run.seed) + (run.fresh ? " (fresh): " : ": ") + run.error + "\n";
  }
  text += "\n" + std::to_string(report.changes.comparisons) + " comparisons, " +
          std::to_string(report.changes.changes.size()) + " changes\n";
  if (!report.changes.changes.empty()) text += changes_table(report.changes.changes, 20);
  for (const auto& remark : report.changes.remarks) text += "  " + remark + "\n";
  if (report.left_out > 0) {
    text += "  the time budget left out " + std::to_string(report.left_out) + " runs\n";
  }
  text += archive_text(report.archive);
  double simulated = 0;
  double cpu = 0;
  for (const CaseResult& c : report.cases) {
    simulated += c.simulated_s;
    cpu += c.cpu_s;
  }
  if (cpu > 0) {
    text += "\nsimulated " + fixed(simulated, 0) + " s in " + fixed(cpu, 1) +
            " s of one core: " + fixed(simulated / cpu, 0) + " times real time\n";
  }
  return text;
}

std::string json_of(const NightReport& report) {
  const Night& night = report.night;
  ordered_json cases = ordered_json::array();
  for (const CaseResult& c : report.cases) {
    cases.push_back({{"case", c.name},
                     {"runs", c.runs},
                     {"passed", c.passed},
                     {"failed", c.failed},
                     {"errors", c.errors},
                     {"may_fail", c.may_fail},
                     {"too_many_failed", c.too_many_failed},
                     {"simulated_s", c.simulated_s},
                     {"cpu_s", c.cpu_s}});
  }
  ordered_json changes = ordered_json::array();
  for (const FlaggedChange& c : report.changes.changes) changes.push_back(json_of(c));
  ordered_json runs = ordered_json::array();
  for (const FinishedRun& r : report.runs) {
    runs.push_back({{"case", r.case_name},
                    {"build", name_of(r.build)},
                    {"seed", r.seed},
                    {"fresh", r.fresh},
                    {"outcome", name_of(r.outcome)},
                    {"reason", r.error},
                    {"directory", r.directory},
                    {"simulated_s", r.simulated_s},
                    {"wall_s", r.wall_s}});
  }
  const ordered_json json = {{"night", night.name},
                             {"number", night.number},
                             {"verdict", night.verdict},
                             {"exit_code", report.exit_code()},
                             {"begun", night.begun},
                             {"ended", night.ended},
                             {"version", night.version},
                             {"build", night.build},
                             {"baseline", night.baseline},
                             {"configuration_hash", night.configuration_hash},
                             {"wall_s", night.wall_s},
                             {"left_out", report.left_out},
                             {"comparisons", report.changes.comparisons},
                             {"changes", changes},
                             {"remarks", report.changes.remarks},
                             {"archive", json_of(report.archive)},
                             {"notification", report.notification},
                             {"cases", cases},
                             {"runs", runs}};
  return json_text(json, 2) + "\n";
}

std::string junit_of(const NightReport& report) {
  using Result = evaluation::JunitCase::Result;
  std::vector<evaluation::JunitSuite> suites;
  for (const CaseResult& c : report.cases) {
    evaluation::JunitSuite suite;
    suite.name = c.name;
    suite.properties = {{"version", report.night.version},
                        {"configuration_hash", report.night.configuration_hash}};
    for (const FinishedRun& run : report.runs) {
      if (run.case_name != c.name || run.build != Build::tonight) continue;
      evaluation::JunitCase test;
      test.class_name = c.name;
      test.name = "seed " + std::to_string(run.seed);
      test.time_s = run.wall_s;
      const bool failed = run.failed();
      // As many failures as the plan allows are reported without failing the night.
      test.result = run.passed()                  ? Result::passed
                    : failed && c.too_many_failed ? Result::failed
                    : failed                      ? Result::skipped
                                                  : Result::error;
      test.message = std::string(name_of(run.outcome)) + ": " + run.error;
      suite.time_s += run.wall_s;
      suite.cases.push_back(test);
    }
    std::size_t flagged = 0;
    for (const FlaggedChange& change : report.changes.changes) {
      if (change.case_name != c.name || change.kind == "better") continue;
      ++flagged;
      suite.cases.push_back({c.name, "against the " + change.against + ": " + name_of(change),
                             Result::failed, sentence_of(change), 0});
    }
    if (flagged == 0) suite.cases.push_back({c.name, "no change", Result::passed, "", 0});
    suites.push_back(suite);
  }
  if (!report.archive.runs.empty()) {
    evaluation::JunitSuite suite;
    suite.name = "archive";
    for (const ArchivedRun& run : report.archive.runs) {
      suite.cases.push_back(
          {"archive", run.name, run.error.empty() ? Result::passed : Result::error, run.error, 0});
    }
    suites.push_back(suite);
  }
  return evaluation::junit_xml(suites);
}

std::string notify(const std::string& command, const NightReport& report,
                   const std::filesystem::path& out, const std::filesystem::path& program) {
  const std::vector<std::pair<std::string, std::string>> environment = {
      {"BERTH_NIGHT", report.night.name},
      {"BERTH_NIGHT_VERDICT", report.night.verdict},
      {"BERTH_NIGHT_EXIT_CODE", std::to_string(report.exit_code())},
      {"BERTH_NIGHT_DIRECTORY", (out / report.night.name).string()},
      {"BERTH_NIGHT_INDEX", (out / "index.html").string()},
      {"BERTH_NIGHT_VERSION", report.night.version},
      {"BERTH_NIGHT_BUILD", program.string()}};
  try {
    const ProcessEnd end = feed_program({"sh", "-c", command}, text_of(report), environment);
    return end.ok() ? "" : "notify: '" + command + "' " + end.text();
  } catch (const std::exception& e) {
    return std::string("notify: ") + e.what();
  }
}

}  // namespace berth::nights
