// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "drivers/simulated/simulated_controller.h"
#include "drivers/simulated/simulated_instruments.h"
#include "drivers/simulated/simulated_plc.h"
#include "drivers/simulated/world.h"

namespace berth {

/// config/simulation.yaml: the simulated cell but for its LIDAR.
struct SimulationSettings {
  SimulatedController::Options controller;
  SimulatedPlc::Options plc;
  WorldSettings world;
  SimulatedTracker::Options tracker;
  SimulatedInertial::Options inertial;
};

/// @throws InputError.
SimulationSettings load_simulation(const std::filesystem::path& file);

}  // namespace berth
