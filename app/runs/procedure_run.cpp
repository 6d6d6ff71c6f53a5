// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/procedure_run.h"

#include "app/runs/config_override.h"
#include "app/runs/own_estimator.h"
#include "evaluation/run/own_estimator.h"

namespace berth {

ProcedureRun procedure_run(const RunFiles& files) {
  ProcedureRun run;
  run.file = files.procedure();
  run.parameters = of_procedure(files.parameters);
  run.name = files.name;
  run.host = files.host == "twin"   ? run_info_t::TWIN
             : files.host == "cell" ? run_info_t::CELL
                                    : run_info_t::SIMULATED_CELL;
  run.attended = files.host != "twin";
  if (const auto own = record_of_own_estimator(files.estimator); !own.name.empty()) {
    run.attachments.push_back(evaluation::attachment_of_own_estimator(own.name, own.sha256));
  }
  if (files.estimator == outside_estimator) {
    run.outside["estimator"] = how_to_start_estimator(files);
  }
  // It knows at once when a process ends that should not.
  if (files.host != "twin") {
    run.disk = files.directory;
    run.supervisor = "supervisor";
    run.required_nodes.push_back(run.supervisor);
  }
  return run;
}

}  // namespace berth
