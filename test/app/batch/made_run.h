// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "app/batch/result_store.h"

namespace berth {

/// A run that passed, with a value and one that could not be measured.
inline FinishedRun made_run(std::uint64_t seed, bool fresh, double value) {
  FinishedRun run;
  run.case_name = "approach";
  run.seed = seed;
  run.fresh = fresh;
  run.outcome = Outcome::pass;
  run.directory = "runs/approach-seed" + std::to_string(seed);
  run.values = {{"hold", "position_error", "rms", "mm", value, 12},
                {"hold", "x_error", "mean", "mm", std::nan(""), 0}};
  return run;
}

}  // namespace berth
