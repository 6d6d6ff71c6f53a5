// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "app/commands/commands.h"

namespace berth::commands {

void add_doctor(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "doctor", "Examine this machine: multicast, buffers, loopback, recorder, disk, clock");
  auto url = std::make_shared<std::string>();
  command->add_option("--lcm-url", *url, "LCM URL to examine");
  command->callback([url, &exit_code] { exit_code = doctor(*url); });
}

}  // namespace berth::commands
