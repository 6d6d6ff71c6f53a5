// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "common/core/version.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  CLI::App app(
      "Berth runs a hardware-in-the-loop testbed for satellite rendezvous and docking.\n"
      "Exit codes: 0 passed, 1 a criterion failed, 2 the rig or the input was at fault, 3 "
      "aborted,\n"
      "4 inconclusive.",
      "berth");
  app.set_version_flag("--version", std::string(version()));
  app.require_subcommand(1);
  int code = exit_code::passed;
  commands::add_run(app, code);
  commands::add_up(app, code);
  commands::add_runs(app, code);
  commands::add_attach(app, code);
  commands::add_calibrate(app, code);
  commands::add_campaign(app, code);
  commands::add_stop(app, code);
  commands::add_check(app, code);
  commands::add_command(app, code);
  commands::add_console(app, code);
  commands::add_compare(app, code);
  commands::add_report(app, code);
  commands::add_estimate(app, code);
  commands::add_kinematics(app, code);
  commands::add_log(app, code);
  commands::add_nightly(app, code);
  commands::add_spy(app, code);
  commands::add_picture(app, code);
  commands::add_reestimate(app, code);
  commands::add_replay(app, code);
  commands::add_doctor(app, code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? exit_code::passed : exit_code::error;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "berth: %s\n", e.what());
    return exit_code::error;
  }
  return code;
}
