// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/verdict.h"

#include <cstdio>
#include <fstream>

#include "common/core/error.h"
#include "logs/compare/comparison.h"
#include "logs/compare/plot.h"

namespace berth {

int write_verdict(const RunFiles& files, int code) {
  try {
    const logs::ComparedRun run = logs::compare_run(files.log());
    const logs::Comparison& comparison = run.comparison;
    std::ofstream(files.directory / "verdict.txt") << logs::text_of(comparison);
    std::ofstream(files.directory / "results.json") << logs::json_of(comparison) << "\n";
    logs::write_plot(run.record, files.directory / "plot.svg");
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
