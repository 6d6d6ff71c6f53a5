// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"
#include "examples/2_estimator/closest_points.h"

int main(int argc, char* argv[]) {
  return berth::run_node_program(
      argc, argv, "closest-points",
      "Tracks the target by the points of its mesh nearest to returns.",
      [](berth::ProcessHost& host) {
        return make_closest_points(host.node("estimator"), host.files.setup, host.bus, host.loop);
      });
}
