// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/run_info_t.hpp>
#include <string>

#include "common/core/run_setup.h"
#include "common/targets/target.h"
#include "procedures/language/procedure.h"

namespace berth::procedures {

/// RUN_INFO of a run, with its inputs attached: the procedure as run, the layout, and every other
/// YAML file of the configuration directory. A file that does not fit into one message is named by
/// its hash alone. utime and seq are left to the sender.
/// @throws InputError when a file cannot be read.
run_info_t make_run_info(const Procedure& procedure, const RunSetup& setup, const Target& target,
                         const std::string& run, std::int8_t host,
                         const std::string& configuration_hash);

}  // namespace berth::procedures
