// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/verdict.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>

#include "app/exit_code.h"
#include "common/core/child_process.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "evaluation/compare/junit.h"

namespace berth::nights {
namespace {

using nlohmann::ordered_json;

/// "+10.2 % [8.1, 12.3]" where both are above zero, else "+0.31 mm [0.25, 0.37]".
std::string change_of(const FlaggedChange& c) {
  const double difference = c.after - c.before;
  const std::string sign = difference < 0 ? "" : "+";
  if (c.before > 0 && c.after > 0) {
    const double percent = 100 / c.before;
    return sign + fixed(percent * difference, 1) + " % [" + fixed(percent * c.low, 1) + ", " +
           fixed(percent * c.high, 1) + "]";
  }
  return sign + shown(difference) + " " + c.unit + " [" + shown(c.low) + ", " + shown(c.high) + "]";
}

/// For people: not all of many.
std::string first_changes(const std::vector<FlaggedChange>& changes) {
  constexpr std::size_t max_rows = 20;
  Table table = changes_table(changes);
  table.rows.resize(std::min(max_rows, changes.size()));
  const std::string text = text_table(table);
  if (changes.size() <= max_rows) return text;
  return text + "  and " + std::to_string(changes.size() - max_rows) + " more: see index.html\n";
}

std::string archive_text(const ArchiveResult& archive) {
  if (archive.runs.empty()) return "";
  return "\narchive, estimated again: " + std::to_string(archive.runs.size()) + " runs, " +
         std::to_string(archive.changes.size()) + " changes\n" +
         text_table(archive_table(archive)) +
         (archive.changes.empty() ? "" : "\n" + first_changes(archive.changes));
}

/// As many failures as the plan allows are reported without failing the night.
Table::Status status_of(const NightReport& report, const FinishedRun& run) {
  if (run.passed()) return Table::passed;
  if (!run.failed()) return Table::error;
  const bool too_many = std::any_of(
      report.cases.begin(), report.cases.end(),
      [&](const CaseResult& c) { return c.name == run.case_name && c.too_many_failed; });
  return too_many ? Table::failed : Table::inconclusive;
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

std::string place_of(const NightReport& report, const FinishedRun& run) {
  if (run.directory.empty()) return "";
  const std::string place = report.night.name + "/" + run.directory + "/";
  for (const char* file : {"report.html", "plot.svg", "verdict.txt"}) {
    if (std::filesystem::exists(report.out / place / file)) return place + file;
  }
  return place;
}

Table changes_table(const std::vector<FlaggedChange>& changes) {
  Table table{"llllll",
              {keyed("change", "kind"), "against", "case", "phase", "measurement", "statistic",
               "unit", "before", "after", json_only("difference_low"), json_only("difference_high"),
               no_json("change [95 %]"), keyed("p-value", "chance"), "runs"}};
  for (const FlaggedChange& c : changes) {
    table.rows.push_back(
        {{c.kind, c.against, c.case_name, c.phase, c.measurement, c.statistic, c.unit,
          valued(shown(c.before), c.before), valued(shown(c.after), c.after), valued("", c.low),
          valued("", c.high), change_of(c), valued(fixed(c.p, 5), c.p), c.runs},
         c.kind == "better" ? Table::passed : Table::failed,
         "against the " + c.against + ": " + c.case_name + ", " + c.phase + ": " + c.measurement +
             " (" + c.statistic + ")"});
  }
  return table;
}

Table cases_table(const NightReport& report) {
  Table table{"ll",
              {no_json("result"), "case", "runs", "passed", "failed", "errors",
               keyed("may fail", "may_fail"), json_only("too_many_failed"),
               keyed("simulated s", "simulated_s"), json_only("cpu_s"), no_json("x real time")}};
  for (const CaseResult& c : report.cases) {
    table.rows.push_back(
        {{c.too_many_failed ? "FAIL"
          : c.errors > 0    ? "ERROR"
                            : "ok",
          c.name, c.runs, c.passed, c.failed, c.errors,
          valued(fixed(100 * c.may_fail, 0) + " %", c.may_fail), valued("", c.too_many_failed),
          valued(fixed(c.simulated_s, 0), c.simulated_s), valued("", c.cpu_s),
          c.cpu_s > 0 ? fixed(c.simulated_s / c.cpu_s, 0) : "-"},
         c.too_many_failed ? Table::failed
         : c.errors > 0    ? Table::error
                           : Table::passed});
  }
  return table;
}

Table runs_table(const NightReport& report,
                 const std::function<bool(const FinishedRun&)>& selected) {
  Table table{"llllll",
              {no_json("outcome"), "case", "build", keyed("run", "seed"), keyed("seed", "fresh"),
               json_only("outcome"), "reason", json_only("directory"), json_only("simulated_s"),
               json_only("wall_s")}};
  for (const FinishedRun& r : report.runs) {
    if (selected && !selected(r)) continue;
    Table::Cell seed("seed " + std::to_string(r.seed), r.seed);
    seed.link = place_of(report, r);
    table.rows.push_back({{name_of(r.outcome), r.case_name, name_of(r.build), seed,
                           valued(r.fresh ? "fresh" : "fixed", r.fresh), name_of(r.outcome),
                           r.error, r.directory, valued("", r.simulated_s), valued("", r.wall_s)},
                          status_of(report, r),
                          seed.text,
                          "",
                          r.wall_s});
  }
  return table;
}

Table archive_table(const ArchiveResult& archive) {
  Table table{"ll",
              {no_json("against truth"), keyed("recorded run", "run"), json_only("error"),
               json_only("verdict"), "estimates", keyed("as recorded", "estimates_same")}};
  for (const ArchivedRun& r : archive.runs) {
    table.rows.push_back({{r.error.empty() ? r.verdict : "ERROR: " + r.error, r.name, r.error,
                           r.verdict, r.estimates, r.same},
                          !r.error.empty()       ? Table::error
                          : r.verdict == "worse" ? Table::none
                                                 : Table::passed,
                          r.name});
  }
  return table;
}

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
  text += "\n" + text_table(cases_table(report));

  const Table not_passed = runs_table(report, std::not_fn(&FinishedRun::passed));
  if (!not_passed.rows.empty()) text += "\nruns that did not pass\n" + text_table(not_passed);
  text += "\n" + std::to_string(report.changes.comparisons) + " comparisons, " +
          std::to_string(report.changes.changes.size()) + " changes\n";
  if (!report.changes.changes.empty()) text += first_changes(report.changes.changes);
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
                             {"changes", json_table(changes_table(report.changes.changes))},
                             {"remarks", report.changes.remarks},
                             {"archive",
                              {{"runs", json_table(archive_table(report.archive))},
                               {"changes", json_table(changes_table(report.archive.changes))}}},
                             {"notification", report.notification},
                             {"cases", json_table(cases_table(report))},
                             {"runs", json_table(runs_table(report))}};
  return json_text(json, 2) + "\n";
}

std::string junit_of(const NightReport& report) {
  std::vector<evaluation::JunitSuite> suites;
  for (const CaseResult& c : report.cases) {
    evaluation::JunitSuite& suite = suites.emplace_back();
    suite.name = c.name;
    suite.properties = {{"version", report.night.version},
                        {"configuration_hash", report.night.configuration_hash}};
    const Table runs = runs_table(report, [&c](const FinishedRun& run) {
      return run.case_name == c.name && run.build == Build::tonight;
    });
    for (const Table::Row& run : runs.rows) suite.time_s += run.time_s;
    std::vector<FlaggedChange> flagged;
    std::copy_if(report.changes.changes.begin(), report.changes.changes.end(),
                 std::back_inserter(flagged), [&c](const FlaggedChange& change) {
                   return change.case_name == c.name && change.kind != "better";
                 });
    Table changes = changes_table(flagged);
    if (flagged.empty()) changes.rows.push_back({{}, Table::passed, "no change"});
    suite.tables = {{c.name, runs}, {c.name, changes}};
  }
  if (!report.archive.runs.empty()) {
    suites.emplace_back().name = "archive";
    suites.back().tables = {{"archive", archive_table(report.archive)}};
  }
  return evaluation::junit_xml(suites);
}

std::string notify(const std::string& command, const NightReport& report,
                   const std::filesystem::path& program) {
  const std::vector<std::pair<std::string, std::string>> environment = {
      {"BERTH_NIGHT", report.night.name},
      {"BERTH_NIGHT_VERDICT", report.night.verdict},
      {"BERTH_NIGHT_EXIT_CODE", std::to_string(report.exit_code())},
      {"BERTH_NIGHT_DIRECTORY", (report.out / report.night.name).string()},
      {"BERTH_NIGHT_INDEX", (report.out / "index.html").string()},
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
