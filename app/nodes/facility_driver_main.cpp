// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"
#include "drivers/facility/facility_node.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  return run_node_program(argc, argv, "facility-driver",
                          "Lamps, E-stop chain and fence on the facility's PLC.",
                          [](ProcessHost& host) {
                            return make_facility_node(host.node("facility-driver"),
                                                      host.files.setup, host.bus, host.loop);
                          });
}
