// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/verdict.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/runs/checksums.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"
#include "logs/compare/comparison.h"
#include "logs/compare/junit.h"
#include "logs/report/report.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

/// Says it and goes on: a run without one of its files is better than one without the others.
template <class Write>
void attempt(Write write) {
  try {
    write();
  } catch (const std::exception& e) {
    print_text(std::string("berth: ") + e.what() + "\n", stderr);
  }
}

/// One JSON object a line.
std::string event_lines(const std::vector<event_t>& events) {
  constexpr const char* severities[] = {"INFO", "NOTICE", "WARNING", "ERROR", "FATAL"};
  std::string text;
  for (const event_t& event : events) {
    const bool known = event.severity >= 0 && event.severity <= event_t::FATAL;
    const nlohmann::ordered_json line = {{"utime", event.utime},
                                         {"node", event.node},
                                         {"severity", known ? severities[event.severity] : "?"},
                                         {"code", event.code},
                                         {"text", event.text}};
    text += json_text(line) + "\n";
  }
  return text;
}

void write_results(const RunFiles& files, logs::Comparison comparison) {
  const fs::path& at = files.directory;
  attempt([&] { write_file(at / "verdict.txt", logs::text_of(comparison)); });
  comparison.log = files.log().filename().string();  // wherever the directory goes
  attempt([&] { write_file(at / "results.json", logs::json_of(comparison)); });
  attempt(
      [&] { write_file(at / "results.xml", logs::junit_xml({logs::junit_suite_of(comparison)})); });
}

/// A run that died before its procedure spoke still leaves a reason where people look.
logs::Comparison without_a_word(const RunFiles& files, const std::string& reason) {
  logs::Comparison comparison;
  comparison.procedure = files.name;
  comparison.outcome = procedure_state_t::ERROR;
  comparison.reason = reason;
  return comparison;
}

}  // namespace

int write_verdict(const RunFiles& files, int code) {
  try {
    if (fs::exists(files.log())) sync_to_disk(files.log());
    const report::ReportedRun run = report::read_reported_run(files.directory);
    const logs::Comparison& comparison = run.run.comparison;
    write_results(files, comparison);
    attempt([&] {
      write_file(files.directory / "events.jsonl", event_lines(run.run.record.events()));
    });
    attempt([&] { report::write_report({&run, 1}, files.directory / "report.html"); });
    if (comparison.recorded_outcome != procedure_state_t::NONE) {
      code = logs::exit_code_of_outcome(comparison.outcome);
    }
  } catch (const InputError& e) {
    write_results(files, without_a_word(files, e.what()));
  }
  attempt([&] { write_checksums(files.directory); });
  return code;
}

}  // namespace berth
