// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/verdict.h"

#include <cstdio>
#include <fstream>

#include "common/core/error.h"
#include "logs/compare/comparison.h"
#include "logs/report/report.h"

namespace berth {
namespace {

/// A verdict stands without a picture of it.
void write_report(const RunFiles& files, const report::ReportedRun& run) {
  try {
    report::write_report({&run, 1}, files.directory / "report.html");
  } catch (const InputError& e) {
    std::fprintf(stderr, "berth: %s\n", e.what());
  }
}

}  // namespace

int write_verdict(const RunFiles& files, int code) {
  try {
    const report::ReportedRun run = report::read_reported_run(files.directory);
    const logs::Comparison& comparison = run.run.comparison;
    std::ofstream(files.directory / "verdict.txt") << logs::text_of(comparison);
    std::ofstream(files.directory / "results.json") << logs::json_of(comparison) << "\n";
    write_report(files, run);
    if (comparison.recorded_outcome != procedure_state_t::NONE) {
      return logs::exit_code_of_outcome(comparison.outcome);
    }
  } catch (const InputError& e) {
    // A run that died before its procedure spoke still leaves a reason where people look.
    std::ofstream(files.directory / "verdict.txt") << "ERROR: " << e.what() << "\n";
  }
  return code;
}

}  // namespace berth
