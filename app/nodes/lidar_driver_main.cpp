// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"
#include "drivers/lidar/lidar_node.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  return run_node_program(
      argc, argv, "lidar-driver",
      "Drives a scanning LIDAR: scan requests in, packets of returns out.", [](ProcessHost& host) {
        return make_lidar_node(host.node("lidar-driver"), host.files.setup, host.bus, host.loop);
      });
}
