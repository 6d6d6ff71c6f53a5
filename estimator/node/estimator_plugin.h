// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "common/bus/node.h"
#include "common/core/run_setup.h"

/// The interface of a shared library for `berth run --twin --estimator LIBRARY`. The library is
/// built from the sources of the Berth that loads it, and uses the code in that program:
///
///     using namespace berth;
///     std::unique_ptr<Node> make_mine(NodeSetup setup, const RunSetup& run, Bus& bus, Loop& loop);
///     BERTH_ESTIMATOR_PLUGIN(make_mine)
namespace berth {

/// Incremented whenever one of the classes below, or its contract, changes.
inline constexpr int estimator_plugin_version = 1;

/// Returned by the library. The first member never moves: the version of any library can be read.
struct EstimatorPlugin {
  int version;  ///< estimator_plugin_version when the library was built
  /// Makes the node from configuration, bus and clock, as make_estimator_node(). It receives
  /// SCAN_DATA and ESTIMATOR_COMMAND; publishes SCAN_REQUEST, POSE_ESTIMATE and ESTIMATOR_STATE, at
  /// 1 Hz too. All its calls come on the loop; the twin is deterministic if it is. The run ends
  /// when this throws; a std::exception's text is shown.
  std::unique_ptr<Node> (*make)(NodeSetup setup, const RunSetup& run, Bus& bus, Loop& loop);
};

/// Name of the one C function, of type EstimatorPluginFunction, that the library exports.
inline constexpr char estimator_plugin_function[] = "berth_estimator_plugin";
using EstimatorPluginFunction = const EstimatorPlugin*();

}  // namespace berth

/// Defines that function, at global scope, once in a library. make: as EstimatorPlugin::make.
#define BERTH_ESTIMATOR_PLUGIN(make_node)                                                   \
  extern "C" __attribute__((visibility("default"))) const berth::EstimatorPlugin*           \
  berth_estimator_plugin() {                                                                \
    static const berth::EstimatorPlugin plugin{berth::estimator_plugin_version, make_node}; \
    return &plugin;                                                                         \
  }
