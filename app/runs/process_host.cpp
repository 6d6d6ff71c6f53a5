// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/process_host.h"

#include <sched.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/bus/lcm_bus.h"
#include "common/bus/process_loop.h"
#include "common/core/valid_text.h"
#include "common/core/version.h"

namespace berth {
namespace {

/// Control loops keep their beat on a busy machine where the system lets us; else nothing is lost.
void request_real_time() {
  sched_param parameter{};
  parameter.sched_priority = 10;
  sched_setscheduler(0, SCHED_RR | SCHED_RESET_ON_FORK, &parameter);
}

}  // namespace

int run_node_program(int argc, char* argv[], const std::string& name,
                     const std::string& description,
                     const std::function<std::unique_ptr<Node>(ProcessHost&)>& make,
                     const std::function<void(CLI::App&)>& add_options) {
  CLI::App options(description, "berth-" + name);
  options.set_version_flag("--version", std::string(version()));
  std::filesystem::path run;
  std::string url;
  bool real_time = false;
  options.add_option("--run", run, "Run directory: run.yaml and config/")
      ->required()
      ->check(CLI::ExistingDirectory);
  options.add_option("--lcm-url", url, "LCM URL instead of the run's own");
  options.add_flag("--real-time", real_time, "Ask for a real-time priority");
  if (add_options) add_options(options);
  try {
    options.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return options.exit(e) == 0 ? 0 : 2;
  }
  try {
    if (real_time) request_real_time();
    const RunFiles files = RunFiles::open(run);
    ProcessLoop loop(clock_offset_from_environment());
    loop.stop_on_signals();
    LcmBus bus(url.empty() ? files.url : url, loop);
    int exit_code = 0;
    ProcessHost host{files, bus, loop, [&](int code) {
                       exit_code = code;
                       loop.stop();
                     }};
    const auto node = make(host);
    bus.start();
    loop.run();
    return exit_code;
  } catch (const std::exception& e) {
    print_text("berth-" + name + ": " + e.what() + "\n", stderr);
    return 2;
  }
}

}  // namespace berth
