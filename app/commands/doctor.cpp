// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <memory>

#include "app/commands/commands.h"
#include "app/doctor/hardware.h"
#include "app/doctor/host.h"
#include "app/runs/choose_setup.h"

namespace berth::commands {
namespace {

struct DoctorOptions {
  std::string url;
  bool hardware = false;
  SetupChoice cell;
  double seconds = 5;
};

}  // namespace

void add_doctor(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "doctor",
      "Examine this machine: multicast, buffers, loopback, recorder, disk, clock.\n"
      "--hardware: the devices at the configured addresses instead: both arms' controllers, the\n"
      "PLC and the LIDAR. It only reads. Exit code 2 when something is BAD.");
  auto options = std::make_shared<DoctorOptions>();
  command->add_option("--lcm-url", options->url, "LCM URL to examine");
  auto* hardware =
      command->add_flag("--hardware", options->hardware, "Examine the devices, not this machine");
  command
      ->add_option("--config", options->cell.config,
                   "Configuration directory instead of the one shipped")
      ->needs(hardware);
  command->add_option("--layout", options->cell.layout, "Layout of config/layouts: whose arms")
      ->needs(hardware);
  command
      ->add_option("--seconds", options->seconds,
                   "How long the devices are read: the longer, the better is a clock's drift known")
      ->needs(hardware)
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str();
  command->callback([options, &exit_code] {
    exit_code =
        print_findings(options->hardware ? examine_hardware(choose_setup(options->cell, nullptr),
                                                            utime_from_seconds(options->seconds))
                                         : examine(options->url));
  });
}

}  // namespace berth::commands
