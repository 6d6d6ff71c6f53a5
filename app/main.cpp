// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "common/core/nearest_word.h"
#include "common/core/valid_text.h"
#include "common/core/version.h"

namespace {

/// In a command that has arguments of its own an option takes one word at a time (--set a=1
/// --set b=2), so that an argument may follow it, as help shows them.
void take_one_word_each(CLI::App& app) {
  const std::vector<CLI::Option*> options = app.get_options();
  const bool has_arguments =
      std::any_of(options.begin(), options.end(),
                  [](const CLI::Option* option) { return option->get_positional(); });
  for (CLI::Option* option : options) {
    if (has_arguments && !option->get_positional()) option->allow_extra_args(false);
  }
  for (CLI::App* command : app.get_subcommands({})) take_one_word_each(*command);
}

/// The error of a command line with an unknown command, with the nearest known one; empty when its
/// commands are known.
std::string unknown_command(const CLI::App& app) {
  const CLI::App* at = &app;
  while (!at->get_subcommands().empty()) at = at->get_subcommands().front();
  std::vector<std::string> known;
  for (const CLI::App* command : at->get_subcommands({})) known.push_back(command->get_name());
  const std::vector<std::string> rest = at->remaining();
  const auto word = std::find_if(rest.begin(), rest.end(),
                                 [](const std::string& w) { return w.empty() || w[0] != '-'; });
  if (known.empty() || word == rest.end()) return {};
  const std::string nearest = berth::nearest_word(*word, known);
  const std::string path = at == &app ? "berth" : "berth " + at->get_name();
  return path + ": found '" + *word + "', which is no command" +
         (nearest.empty() ? "" : "; did you mean '" + nearest + "'?") + "\n" + path +
         " --help lists them";
}

}  // namespace

int main(int argc, char* argv[]) {
  using namespace berth;
  CLI::App app(
      "Berth runs a hardware-in-the-loop testbed for satellite rendezvous and docking.\n"
      "Exit codes: 0 passed, 1 a criterion failed, 2 the rig or the input was at fault, 3 "
      "aborted,\n"
      "4 inconclusive; of several runs the worst, in this order: 0 4 1 2 3.",
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
  commands::add_config(app, code);
  commands::add_console(app, code);
  commands::add_compare(app, code);
  commands::add_report(app, code);
  commands::add_estimate(app, code);
  commands::add_kinematics(app, code);
  commands::add_lidar(app, code);
  commands::add_log(app, code);
  commands::add_nightly(app, code);
  commands::add_spy(app, code);
  commands::add_target(app, code);
  commands::add_picture(app, code);
  commands::add_reestimate(app, code);
  commands::add_replay(app, code);
  commands::add_doctor(app, code);
  take_one_word_each(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (const std::string fault = unknown_command(app); !fault.empty()) {
      print_text(fault + "\n", stderr);
      return exit_code::error;
    }
    return app.exit(e) == 0 ? exit_code::passed : exit_code::error;
  } catch (const std::exception& e) {
    print_text(std::string("berth: ") + e.what() + "\n", stderr);
    return exit_code::error;
  }
  return code;
}
