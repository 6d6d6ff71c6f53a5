// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/index_page.h"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include "app/batch/nights/runner.h"
#include "app/batch/nights/trend.h"
#include "common/core/error.h"
#include "common/core/text.h"
#include "evaluation/measure/measurer.h"
#include "evaluation/measure/statistic.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/html.h"
#include "evaluation/report/sections.h"

namespace berth::nights {
namespace {

using namespace report;

/// Values of a criterion in tonight's runs of a case, in its shown unit.
std::vector<double> values_of(const NightReport& report, const std::string& case_name,
                              const evaluation::Criterion& criterion) {
  std::vector<double> values;
  for (const FinishedRun& run : report.runs) {
    if (run.case_name != case_name || run.build != Build::tonight) continue;
    for (const RunValue& v : run.values) {
      if (v.statistic == criterion.name && v.phase == criterion.phase) values.push_back(v.value);
    }
  }
  return values;
}

void add_rows(const Case& of_plan, const NightReport& report, Table& table) {
  for (const evaluation::Criterion& c : criteria_of(of_plan)) {
    if (c.claim.empty()) continue;
    const std::vector<double> values = values_of(report, of_plan.name, c);
    const double low = c.measurement->shown(c.lower);
    const double high = c.measurement->shown(c.upper);
    criterion_result_t limits{};
    limits.lower_limit = low;
    limits.upper_limit = high;
    const auto met = std::count_if(values.begin(), values.end(),
                                   [&](double v) { return v >= low && v <= high; });
    const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
    const auto runs = static_cast<std::ptrdiff_t>(values.size());
    table.rows.push_back({text(of_plan.name), text(c.claim),
                          limits_of(limits) + text(" " + c.measurement->unit),
                          text(brief(evaluation::compute(evaluation::Statistic::p50, values))),
                          values.empty() ? Html() : text(brief(*least) + " to " + brief(*greatest)),
                          element("b",
                                  met == runs && runs > 0 ? "good"
                                  : 2 * met >= runs       ? "unsure"
                                                          : "bad",
                                  text(std::to_string(met) + " of " + std::to_string(runs)))});
  }
}

constexpr std::size_t nights_shown = 60;

/// Shown in addition to the criteria, for the whole run: what an estimator engineer looks at first.
const std::vector<std::pair<const char*, const char*>>& always_shown() {
  static const std::vector<std::pair<const char*, const char*>> list = {
      {"position_error", "rms"}, {"attitude_error", "rms"},
      {"velocity_error", "rms"}, {"angular_velocity_error", "rms"},
      {"nees", "mean"},          {"estimate_delay", "value"},
      {"update_rate", "value"},  {evaluation::passed_measurement, "value"}};
  return list;
}

const char* colour_of(const std::string& verdict) {
  if (verdict == "clean") return "good";
  if (verdict == "interrupted") return "grey";
  return verdict == "error" ? "unsure" : "bad";
}

Html verdict_word(const std::string& verdict) {
  return element("b", colour_of(verdict), text(verdict));
}

Html fact(const std::string& name, const Html& value) {
  return markup("<div>") + element("dt", "", text(name)) + element("dd", "", value) +
         markup("</div>");
}

std::string then(const std::string& now, const std::string& before) {
  return before.empty() || now == before ? now : now + ", was " + before;
}

Html head_of(const NightReport& report) {
  const Night& night = report.night;
  const Night before = report.previous.value_or(Night{});
  std::size_t worse = 0;
  for (const FlaggedChange& c : report.changes.changes) worse += c.kind == "better" ? 0 : 1;
  std::size_t runs = 0;
  std::size_t passed = 0;
  double simulated = 0;
  double cpu = 0;
  for (const CaseResult& c : report.cases) {
    runs += c.runs;
    passed += c.passed;
    simulated += c.simulated_s;
    cpu += c.cpu_s;
  }
  std::string summary = std::to_string(passed) + " of " + std::to_string(runs) + " runs passed; " +
                        std::to_string(worse) + " of " +
                        std::to_string(report.changes.comparisons) +
                        " comparisons show a change for the worse.";
  if (report.left_out > 0) {
    summary += " The time budget left out " + std::to_string(report.left_out) + " runs.";
  }
  std::string verdict = night.verdict;
  for (char& c : verdict) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  const Html heading =
      element("h1", "", element("span", "outcome", text(verdict)) + text("night " + night.name));
  const Html facts = element(
      "dl", "facts",
      fact("version", text(then(night.version, before.version))) +
          fact("configuration", text(then(night.configuration_hash.substr(0, 12),
                                          before.configuration_hash.substr(0, 12)))) +
          fact("baseline", text(night.baseline.empty() ? "none" : night.baseline)) +
          fact("begun", text(night.begun)) + fact("lasted", text(fixed(night.wall_s, 0) + " s")) +
          fact("speed",
               text(cpu > 0 ? fixed(simulated / cpu, 0) + " x real time on one core" : "-")) +
          fact("files", link(night.name + "/summary.txt", text("summary")) + text(" · ") +
                            link(night.name + "/summary.json", text("JSON")) + text(" · ") +
                            link(night.name + "/results.xml", text("JUnit"))));
  return element("div", (std::string("verdict ") + colour_of(night.verdict)).c_str(),
                 heading + element("p", "", text(summary)) + facts);
}

Html section_of(const Table& table, const char* if_empty) {
  return table.rows.empty() ? element("p", "", text(if_empty)) : html_of(table);
}

Html archive_section(const ArchiveResult& archive) {
  return element("p", "soft",
                 text("Tonight's estimator over recorded scans: estimates that differ from those "
                      "recorded, and whether they are nearer to the truth.")) +
         html_of(archive_table(archive)) +
         section_of(changes_table(archive.changes), "No changes.");
}

/// With links to the runs that are kept.
Html cases_section(const NightReport& report) {
  Table table = cases_table(report);
  table.head.push_back("runs kept");
  for (std::size_t i = 0; i < table.rows.size(); ++i) {
    Html kept;
    for (const FinishedRun& run : report.runs) {
      if (run.case_name != report.cases[i].name || run.build != Build::tonight ||
          run.directory.empty())
        continue;
      kept += text(kept.empty() ? "" : ", ") +
              link(place_of(report, run), text("seed " + std::to_string(run.seed)));
    }
    table.rows[i].cells.push_back(kept);
  }
  return html_of(table);
}

Html nights_table(ResultStore& history, const std::vector<Night>& nights) {
  Table table{"lllll",
              {"night", "verdict", "version", "configuration", "baseline", "runs", "not passed",
               "flagged", "lasted"}};
  for (auto night = nights.rbegin(); night != nights.rend(); ++night) {
    const auto runs = history.runs(*night, ResultStore::Which::all_without_values);
    const auto not_passed = std::count_if(runs.begin(), runs.end(), [](const FinishedRun& r) {
      return !r.passed() && r.build == Build::tonight;
    });
    const auto older = std::next(night);
    const auto marked = [&](const std::string& now, const std::string& then) {
      return older == nights.rend() || now == then ? text(now) : element("b", "", text(now));
    };
    table.rows.push_back(
        {link(night->name + "/summary.txt", text(night->name)),
         verdict_word(night->verdict) + text(night->accepted ? " (accepted)" : ""),
         marked(night->version, older == nights.rend() ? "" : older->version),
         marked(night->configuration_hash.substr(0, 12),
                older == nights.rend() ? "" : older->configuration_hash.substr(0, 12)),
         text(night->baseline), text(std::to_string(runs.size())), text(std::to_string(not_passed)),
         text(std::to_string(history.changes(*night).size())),
         text(fixed(night->wall_s, 0) + " s")});
  }
  return element("p", "soft", text("Bold: other than the night before.")) + html_of(table);
}

/// Where it was flagged, by night.
using Flags = std::map<std::vector<std::string>, std::vector<std::int64_t>>;

Flags flags_of(ResultStore& history, const std::vector<Night>& nights) {
  Flags flags;
  for (const Night& night : nights) {
    for (const FlaggedChange& c : history.changes(night)) {
      auto& list = flags[{c.case_name, c.phase, c.measurement, c.statistic}];
      if (list.empty() || list.back() != night.number) list.push_back(night.number);
    }
  }
  return flags;
}

/// Flagged quantities first, then criteria, then what is always shown.
std::vector<TrendSubject> subjects_of(const NightReport& report, const std::string& case_name) {
  std::vector<TrendSubject> subjects;
  const auto add = [&](const TrendSubject& subject) {
    for (const TrendSubject& other : subjects) {
      if (other.key() == subject.key()) return;
    }
    subjects.push_back(subject);
  };
  constexpr std::size_t max_flagged = 12;
  for (const FlaggedChange& c : report.changes.changes) {
    if (c.case_name != case_name || subjects.size() >= max_flagged) continue;
    add({case_name, c.phase, c.measurement, c.statistic, c.unit});
  }
  for (const FinishedRun& run : report.runs) {
    if (run.case_name != case_name || run.build != Build::tonight) continue;
    for (const RunValue& v : run.values) {
      const bool is_criterion = v.statistic != "value" && !evaluation::statistic_named(v.statistic);
      bool is_shown = false;
      for (const auto& [measurement, statistic] : always_shown()) {
        is_shown = is_shown ||
                   (v.phase == "run" && v.measurement == measurement && v.statistic == statistic);
      }
      if (is_criterion || is_shown) {
        add({case_name, v.phase, v.measurement, v.statistic, v.unit});
      }
    }
  }
  return subjects;
}

}  // namespace

Html claims_table(const Plan& plan, const NightReport& report) {
  Table table{"ll",
              {"procedure", "claim", "claimed", "median", "least to greatest", "runs that met it"}};
  for (const Case& of_plan : plan.cases) {
    try {
      add_rows(of_plan, report, table);
    } catch (const InputError& e) {
      table.rows.push_back({text(of_plan.name), text(e.what()), {}, {}, {}, {}});
    }
  }
  return table.rows.empty() ? Html() : html_of(table);
}

void write_index_page(const Plan& plan, ResultStore& history, const NightReport& report) {
  std::vector<Night> nights;
  for (const Night& night : history.batches()) {
    if (!night.ended.empty() && night.verdict != "interrupted") nights.push_back(night);
  }
  if (nights.size() > nights_shown) {
    nights.erase(nights.begin(), nights.end() - static_cast<std::ptrdiff_t>(nights_shown));
  }
  Page page(plan.name + ": night " + report.night.name);
  page.head(head_of(report));
  page.section("changes", "Flagged changes",
               section_of(changes_table(report.changes.changes), "None."));
  page.section(
      "failures", "Runs that did not pass",
      section_of(runs_table(report, std::not_fn(&FinishedRun::passed)), "All runs passed."));
  page.section("procedures", "Procedures", cases_section(report));
  const Html claims = claims_table(plan, report);
  if (!claims.empty()) page.section("claims", "Claims", claims);
  if (!report.archive.runs.empty()) {
    page.section("archive", "Archive", archive_section(report.archive));
  }
  page.section("nights", "Nights", nights_table(history, nights));
  const Flags flags = flags_of(history, nights);
  std::size_t number = 0;
  for (const CaseResult& c : report.cases) {
    std::vector<Chart> charts;
    for (const TrendSubject& s : subjects_of(report, c.name)) {
      const auto flagged = flags.find({s.case_name, s.phase, s.measurement, s.statistic});
      charts.push_back(
          trend_chart(history, nights, s,
                      flagged == flags.end() ? std::vector<std::int64_t>{} : flagged->second));
    }
    page.section("trend-" + std::to_string(++number), c.name, grid_of(charts));
  }
  Html remarks;
  for (const auto& remark : report.changes.remarks) remarks += element("p", "soft", text(remark));
  remarks += element("p", "soft",
                     text("Every measurement of every phase of every run is in history.sqlite: "
                          "sqlite3 history.sqlite 'SELECT * FROM result LIMIT 10'."));
  page.section("remarks", "Remarks", remarks);
  page.write(report.out / "index.html");
}

}  // namespace berth::nights
