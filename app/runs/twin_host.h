// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>

#include "app/runs/run_files.h"
#include "common/bus/bus.h"
#include "common/bus/loop.h"

namespace berth {

struct TwinResult {
  int exit_code = 2;
  double simulated_s = 0;
  double wall_s = 0;  ///< of the events alone, models and meshes loaded
  double preparation_s = 0;
};

/// By which each node of the twin answers later: twin.yaml of a configuration.
std::map<std::string, Utime> compute_delays(const std::filesystem::path& config);

/// Runs every node of the run, the simulated cell and the procedure in this process, on an
/// in-process bus and a simulated clock, and records run.lcm. Deterministic to the bit for one seed
/// and version. watch sees every message. abort_requested is called now and then. Prompts are
/// answered at once with the answer under their id or their step's name; others wait for their time
/// to be up.
TwinResult run_twin(const RunFiles& files,
                    const std::function<void(const std::string& channel, Bytes)>& watch,
                    const std::function<bool()>& abort_requested,
                    const std::map<std::string, std::string>& answers = {});

}  // namespace berth
