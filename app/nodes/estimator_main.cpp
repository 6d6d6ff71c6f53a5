// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"
#include "estimator/node/estimator_node.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  return run_node_program(
      argc, argv, "estimator", "Model based pose estimation of the target from LIDAR scans.",
      [](ProcessHost& host) {
        return make_estimator_node(host.node("estimator"), host.files.setup, host.bus, host.loop);
      });
}
