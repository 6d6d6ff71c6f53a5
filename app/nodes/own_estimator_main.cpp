// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"
#include "estimator/node/estimator_plugin.h"

/// Defined by BERTH_ESTIMATOR_PLUGIN in a source of the estimator.
extern "C" berth::EstimatorPluginFunction berth_estimator_plugin;

int main(int argc, char* argv[]) {
  using namespace berth;
  return run_node_program(argc, argv, "own-estimator",
                          "An estimator of one's own, in place of Berth's.", [](ProcessHost& host) {
                            return berth_estimator_plugin()->make(
                                host.node("estimator"), host.files.setup, host.bus, host.loop);
                          });
}
