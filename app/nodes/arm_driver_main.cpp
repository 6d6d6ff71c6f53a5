// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>

#include "app/runs/process_host.h"
#include "drivers/arm/arm_node.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  std::string arm;
  return run_node_program(
      argc, argv, "arm-driver", "Drives one arm controller over Modbus TCP.",
      [&](ProcessHost& host) {
        return make_arm_node(host.node("arm-driver-" + arm), host.files.setup,
                             arm == "replica" ? ArmRole::replica : ArmRole::sensor, host.bus,
                             host.loop);
      },
      [&](CLI::App& options) {
        options.add_option("--arm", arm, "Which arm: replica or sensor")
            ->required()
            ->check(CLI::IsMember({"replica", "sensor"}));
      });
}
