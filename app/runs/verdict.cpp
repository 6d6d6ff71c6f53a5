// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/verdict.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/attempt.h"
#include "app/exit_code.h"
#include "app/runs/manifest.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"
#include "evaluation/compare/comparison.h"
#include "evaluation/compare/junit.h"
#include "evaluation/report/report.h"
#include "lcmtypes/words.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

/// One JSON object a line.
std::string event_lines(const std::vector<event_t>& events) {
  std::string text;
  for (const event_t& event : events) {
    const nlohmann::ordered_json line = {{"utime", event.utime},
                                         {"node", event.node},
                                         {"severity", words::of_severity(event.severity)},
                                         {"code", event.code},
                                         {"text", event.text}};
    text += json_text(line) + "\n";
  }
  return text;
}

void write_results(const RunFiles& files, evaluation::Comparison comparison) {
  const fs::path& at = files.directory;
  attempt([&] { write_file(at / "verdict.txt", evaluation::verdict_text(comparison)); });
  comparison.log = files.log().filename().string();  // wherever the directory goes
  attempt([&] { write_file(at / "results.json", evaluation::json_of(comparison)); });
  attempt([&] {
    write_file(at / "results.xml", evaluation::junit_xml({evaluation::junit_suite_of(comparison)}));
  });
}

/// The run of this directory: its log may hold others of the cell that it joined.
report::ReportedRun run_in(const RunFiles& files) {
  if (fs::exists(files.log())) attempt([&] { sync_to_disk(files.log()); });
  std::vector<report::ReportedRun> runs = report::read_reported_runs(files.log(), files.directory);
  const auto found = std::find_if(runs.begin(), runs.end(), [&](const report::ReportedRun& run) {
    const run_info_t* info = run.run.record.info();
    return info != nullptr && info->run == files.name;
  });
  return std::move(found == runs.end() ? runs.back() : *found);
}

}  // namespace

int write_verdict(const RunFiles& files, int code, const std::string& failure) {
  std::optional<report::ReportedRun> run;
  evaluation::Comparison comparison;
  comparison.procedure = files.name;
  comparison.outcome = procedure_state_t::ERROR;
  try {
    run = run_in(files);
    comparison = run->run.comparison;
  } catch (const std::exception& e) {
    comparison.reason = e.what();
  }
  if (comparison.recorded_outcome == procedure_state_t::NONE) {
    // Without its own last word a run is no better than how it ended, and than its log.
    code = exit_code::worst(code, evaluation::exit_code_of_outcome(comparison.outcome));
    comparison.outcome = evaluation::outcome_of_exit_code(code);
    if (!failure.empty()) comparison.reason = failure;
    if (run) run->run.comparison = comparison;
  } else {
    code = evaluation::exit_code_of_outcome(comparison.outcome);
  }
  write_results(files, comparison);
  if (run) {
    attempt([&] {
      write_file(files.directory / "events.jsonl", event_lines(run->run.record.events()));
    });
    attempt([&] { report::write_report({&*run, 1}, files.directory / "report.html"); });
  }
  attempt([&] { write_checksums(files.directory); });
  return code;
}

}  // namespace berth
