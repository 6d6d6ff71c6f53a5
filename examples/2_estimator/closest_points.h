// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "common/bus/node.h"
#include "common/core/run_setup.h"

/// As berth::make_estimator_node().
std::unique_ptr<berth::Node> make_closest_points(berth::NodeSetup setup, const berth::RunSetup& run,
                                                 berth::Bus& bus, berth::Loop& loop);
