// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"
#include "drivers/simulated/simulated_cell.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  return run_node_program(
      argc, argv, "simulated-cell",
      "The simulated devices: two arm controllers, a PLC and a LIDAR on real sockets.",
      [](ProcessHost& host) {
        return make_simulated_cell(host.node("simulated-cell"), host.files.setup, host.bus,
                                   host.loop);
      });
}
