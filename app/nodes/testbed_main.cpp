// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"
#include "testbed/node/testbed_node.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  return run_node_program(
      argc, argv, "testbed", "Moves both arms, publishes ground truth, guards the cell.",
      [](ProcessHost& host) {
        return make_testbed_node(host.node("testbed"), host.files.setup, host.bus, host.loop);
      });
}
