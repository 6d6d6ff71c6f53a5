// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "app/finding.h"
#include "common/bus/loop.h"
#include "common/core/run_setup.h"

namespace berth {

/// Both arms' controllers, the PLC and the LIDAR of a configuration, at its addresses, for so long.
/// Registers are read and never written; the LIDAR is greeted and asked for its clock.
/// @throws InputError for a configuration that is wrong.
std::vector<Finding> examine_hardware(const RunSetup& setup, Utime span);

}  // namespace berth
