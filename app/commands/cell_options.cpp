// SPDX-License-Identifier: BSD-3-Clause
#include "app/commands/cell_options.h"

#include <signal.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <thread>

#include "app/console/serving.h"
#include "app/exit_code.h"
#include "app/runs/active_runs.h"
#include "app/runs/own_estimator.h"
#include "app/runs/supervisor.h"
#include "app/runs/twin_host.h"
#include "app/runs/verdict.h"
#include "app/terminal/interruption.h"
#include "app/terminal/monitor.h"
#include "app/terminal/terminal_view.h"
#include "common/bus/lcm_bus.h"
#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/quantity.h"

namespace berth::commands {
namespace {

/// Waits until the console that was started with the run has reported its address, or some seconds.
void announce_console(const RunFiles& files, pid_t supervisor) {
  constexpr int max_tenths = 100;
  const ProcessHandle process(supervisor);
  for (int tenth = 0; tenth < max_tenths; ++tenth) {
    if (const auto address = console::console_address(files.directory)) {
      std::printf("console %s\n", address->c_str());
      return;
    }
    if (process.ends_within(std::chrono::milliseconds(100))) return;
  }
}

/// --lidar PATH as keys of devices.yaml: a recording takes the LIDAR's place. @throws InputError.
std::map<std::string, std::string> recorded_lidar(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path found = fs::canonical(path, error);
  if (error) throw InputError("--lidar " + path + ": no such file or directory");
  const bool log = found.extension() == ".lcm" || fs::exists(found / "run.lcm", error);
  return {{"devices.yaml:lidar.adapter", log ? "log" : "files"},
          {"devices.yaml:lidar.recording", found.string()}};
}

}  // namespace

std::map<std::string, std::string> assignments_of(const std::string& option,
                                                  const std::vector<std::string>& assignments) {
  std::map<std::string, std::string> values;
  for (const auto& assignment : assignments) {
    const auto equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0) {
      throw InputError(option + " " + assignment + ": expected NAME=VALUE");
    }
    values[assignment.substr(0, equals)] = assignment.substr(equals + 1);
  }
  return values;
}

procedures::Overrides overrides_of(const std::vector<std::string>& assignments) {
  return assignments_of("--set", assignments);
}

double target_length_of(const std::string& text) {
  const bool has_unit = text.find('m') != std::string::npos;
  double length = 0;
  try {
    length = parse_quantity(text + (has_unit ? "" : " m"), Dimension::length);
  } catch (const InputError& e) {
    throw InputError(std::string("--target-length: ") + e.what());
  }
  if (length <= 0) throw InputError("--target-length: must be positive");
  return length;
}

void print_notes(const std::vector<std::string>& notes, const std::string& named) {
  for (const std::string& note : notes) {
    std::fprintf(stderr, "berth: %s: %s\n", named.c_str(), note.c_str());
  }
}

void add_cell_options(CLI::App& command, CellOptions& options) {
  command.add_option("--layout", options.request.layout,
                     "Layout of config/layouts (range, contact, free)");
  command.add_option(
      "--target", options.request.target,
      "Target: a name of targets/, a folder with a target.yaml, or a mesh (PLY, STL, "
      "OBJ)");
  command.add_option(
      "--world", options.request.world,
      "World of config/worlds: how the simulated cell departs from its files (exact, "
      "lab, harsh ...)");
  command.add_option("--target-length", options.target_length,
                     "Scale the target so that its longest side is this long, in metres");
  command.add_option("--seed", options.request.seed, "Seed of everything simulated")
      ->capture_default_str();
  command
      .add_option("--out", options.request.out, "The run directory is made under this directory")
      ->capture_default_str();
  command.add_option("--config", options.request.config,
                     "Configuration directory instead of the one shipped");
  command.add_option("--calibration", options.request.calibration,
                     "Calibration of the cell, made by berth calibrate, instead of the "
                     "configuration's own");
  command.add_option("--operator", options.request.operator_name,
                     "Who runs it, for the record; default: BERTH_OPERATOR, or the user's name");
  command.add_option("--lcm-url", options.request.url,
                     "LCM URL, e.g. udpm://239.255.76.67:7667?ttl=0; testbeds side by side need "
                     "ports of their own");
  command.add_option("--lidar", options.lidar,
                     "Recorded scans instead of the LIDAR: a directory of clouds (PCD, PLY, PTX, "
                     "XYZ) or one, a run directory, or a .lcm log; see docs/lidar.md");
  command.add_option(
      "--estimator", options.estimator,
      "An estimator of your own: a program, or 'outside' where somebody else runs it; "
      "with --twin a shared library; see docs/own_estimator.md");
  command.add_flag("--hardware", options.hardware,
                   "The devices of config/devices.yaml are real: do not simulate them");
  command.add_flag("--no-console", options.no_console,
                   "Do not serve the operator's page; see berth console");
  command.add_flag("--detach", options.detach, "Do not wait; see berth attach and berth stop");
}

void complete(CellOptions& options) {
  RunRequest& request = options.request;
  if (!options.target_length.empty()) {
    request.target_length = target_length_of(options.target_length);
  }
  request.parameters = overrides_of(options.set);
  if (!options.lidar.empty()) request.parameters.merge(recorded_lidar(options.lidar));
  if (options.twin && options.hardware)
    throw InputError("--twin and --hardware exclude each other");
  if (!options.answers.empty() && !options.twin) {
    throw InputError(
        "--answer is for --twin; elsewhere prompts are answered by key or by berth command");
  }
  request.host = options.twin ? "twin" : options.hardware ? "cell" : "simulated-cell";
  if (!options.estimator.empty()) {
    request.estimator = check_own_estimator(options.estimator, request.host);
  }
  if (options.twin) return;
  request.url = bus_url(request.url);
  for (const auto& run : active_runs()) {
    if (run.url != request.url) continue;
    const bool is_cell = !RunFiles::open(run.directory).has_procedure;
    if (!is_cell || request.procedure.empty()) {
      throw InputError(run.directory.string() + " runs on " + request.url +
                       ": berth attach, berth stop, or another --lcm-url");
    }
    if (!options.lidar.empty()) {
      throw InputError("--lidar: the cell of " + run.directory.string() +
                       " is up already: give the option to berth up");
    }
    if (!options.estimator.empty()) {
      throw InputError("--estimator: the cell of " + run.directory.string() +
                       " is up already: give the option to berth up");
    }
    request.joins = run.directory;
  }
}

void add_twin_options(CLI::App& command, CellOptions& options) {
  command.add_flag("--twin", options.twin,
                   "In one process on a simulated clock: deterministic, far faster than real time");
  command
      .add_option("--set", options.set,
                  "A parameter of the procedure, or a key of a configuration file as "
                  "simulation_lidar.yaml:noise_scale")
      ->type_name("NAME=VALUE");
}

int run_in_twin(const RunFiles& files, const std::map<std::string, std::string>& answers) {
  std::printf("twin %s\n", files.directory.c_str());
  terminal::watch_for_interruption();
  terminal::TerminalView view;
  TwinResult result;
  std::string failure;
  try {
    result = run_twin(
        files,
        [&](const std::string& channel, Bytes bytes) {
          view.take(channel, bytes);
          view.refresh();
        },
        terminal::interrupted, answers);
  } catch (const std::exception& e) {
    failure = e.what();
  }
  const int code = write_verdict(files, result.exit_code, failure);
  view.clear_panel();
  terminal::show_verdict(files);
  if (!failure.empty()) return code;
  std::printf("simulated %.1f s in %.2f s: %.0f times real time (and %.2f s to prepare)\n",
              result.simulated_s, result.wall_s, result.simulated_s / result.wall_s,
              result.preparation_s);
  return code;
}

int run_in_processes(const RunFiles& files, const CellOptions& options) {
  const bool with_console =
      !options.no_console && !files.joins && console::load_console_config(files.setup.config).start;
  std::printf("run %s\n", files.directory.c_str());
  if (files.estimator == outside_estimator && !files.joins) {
    std::printf("the estimator is %s\n", how_to_start_estimator(files).c_str());
  }
  std::fflush(stdout);
  const auto supervisor = supervise_in_background(files, with_console);
  if (options.detach) {
    if (with_console) announce_console(files, supervisor->pid());
    return exit_code::passed;
  }
  return monitor({supervisor->pid(), files.directory, bus_url(files.url)}, false, supervisor.get());
}

}  // namespace berth::commands
