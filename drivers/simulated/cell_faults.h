// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "drivers/simulated/cell_scene.h"
#include "drivers/simulated/injection.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "drivers/simulated/simulated_controller.h"
#include "drivers/simulated/simulated_plc.h"

namespace berth {

/// All that a procedure can make go wrong in the simulated cell: docs/simulated_cell.md has the
/// table. The devices must outlive it.
FaultTable cell_faults(SimulatedController& replica, SimulatedController& sensor, SimulatedPlc& plc,
                       SimulatedLidar& lidar, CellScene& scene);

}  // namespace berth
