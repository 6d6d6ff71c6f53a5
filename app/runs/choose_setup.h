// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/run_setup.h"
#include "procedures/language/procedure.h"

namespace berth {

/// The operator's choices in addition to the procedure; empty: the procedure's own, or the default.
struct SetupChoice {
  std::filesystem::path config;
  std::string layout;
  std::string target;
  double target_length = 0;
  std::string world = {};
};

/// The target that a configuration names: key `target` of testbed.yaml. @throws InputError.
std::string default_target(const std::filesystem::path& config);

/// Configuration, layout and target of a run; its seed and session are left as they are. The
/// target's path is made absolute. procedure: nullptr for a cell alone.
/// @throws InputError where there is no such configuration, layout or target.
RunSetup choose_setup(const SetupChoice& choice, const procedures::Procedure* procedure);

/// The simulated cell's world (config/worlds) that the operator or, by default, the procedure
/// chose; empty: that of simulation.yaml.
/// @throws InputError where the configuration has no such world.
std::string choose_world(const SetupChoice& choice, const std::filesystem::path& config,
                         const procedures::Procedure* procedure);

}  // namespace berth
