// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/console/replay_console.h"
#include "app/console/server/credentials.h"
#include "app/console/serving.h"
#include "app/exit_code.h"
#include "app/host_name.h"
#include "app/runs/active_runs.h"
#include "app/runs/run_files.h"
#include "app/runs/run_list.h"
#include "common/bus/lcm_bus.h"
#include "common/core/child_process.h"
#include "common/core/error.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct ConsoleOptions {
  std::vector<fs::path> runs;
  std::string url;
  console::ServingOptions serving;
  std::string credentials;
  std::vector<std::string> names;
};

std::optional<ActiveRun> active(const ConsoleOptions& options) {
  if (!options.runs.empty()) return find_active_run(options.runs.front());
  if (options.url.empty()) return find_active_run();
  std::optional<ActiveRun> newest;
  for (const ActiveRun& run : active_runs()) {
    if (run.url == bus_url(options.url)) newest = run;
  }
  return newest;
}

/// The page of what runs: of its own console, or of one that is started here.
int look_at(const ActiveRun& run, const ConsoleOptions& options) {
  const auto address = console::console_address(run.directory);
  if (address && !options.serving.given()) {
    std::printf("console %s\n", address->c_str());
    return exit_code::passed;
  }
  std::vector<std::string> arguments{(program_directory() / "berth-console").string(), "--run",
                                     run.directory.string(), "--lcm-url", run.url};
  for (const std::string& word : options.serving.arguments()) arguments.push_back(word);
  std::printf("run %s; Ctrl-C ends this console, not the run\n", run.directory.c_str());
  become_program(arguments);
}

int make_credentials(const ConsoleOptions& options) {
  std::vector<std::string> names{host_name(), "localhost", "127.0.0.1", "::1"};
  names.insert(names.end(), options.names.begin(), options.names.end());
  const auto made = console::make_credentials(options.credentials, names);
  std::printf(
      "%s, %s and %s are made; the certificate is for %d days.\n"
      "Its SHA-256 fingerprint, to compare with what a browser shows:\n  %s\n"
      "Serve with them:\n"
      "  berth console --listen 0.0.0.0 --token-file %s --certificate %s --key %s\n"
      "and open once, with the token of the first file: https://%s:8800/?token=...\n",
      made.token.c_str(), made.certificate.c_str(), made.key.c_str(), made.days,
      made.fingerprint.c_str(), made.token.c_str(), made.certificate.c_str(), made.key.c_str(),
      names.front().c_str());
  return exit_code::passed;
}

int serve(ConsoleOptions options) {
  if (!options.credentials.empty()) return make_credentials(options);
  for (fs::path& run : options.runs) run = directory_of_run(run.string());
  if (options.runs.size() < 2) {
    if (const auto run = active(options)) return look_at(*run, options);
  }
  if (options.runs.empty()) {
    throw InputError("nothing is running" + (options.url.empty() ? "" : " on " + options.url) +
                     ": berth up and berth run start a console too; berth console RUN replays");
  }
  const fs::path second = options.runs.size() > 1 ? options.runs[1] : fs::path();
  auto config = console::load_console_config(RunFiles::open(options.runs.front()).setup.config);
  options.serving.apply_to(config);
  console::serve_replay(options.runs.front(), second, console::serving(config));
  return exit_code::passed;
}

}  // namespace

void add_console(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "console",
      "The operator's page in a browser: of what runs now, or a recorded run, or two side by\n"
      "side. Prints its address. From another host: ssh -L 8800:localhost:8800 HOST, or token\n"
      "and certificate");
  auto options = std::make_shared<ConsoleOptions>();
  command
      ->add_option("run", options->runs,
                   "Run directory, name of a run in runs/, or 'last'; two side by side; what runs "
                   "when left out")
      ->expected(0, 2);
  command->add_option("--lcm-url", options->url, "Of what runs on this bus");
  options->serving.add_to(*command);
  command
      ->add_option("--make-credentials", options->credentials,
                   "Make a token and a self-signed certificate in this directory, and end")
      ->type_name("DIR");
  command->add_option("--name", options->names,
                      "With --make-credentials: another name or address the certificate is for");
  command->callback([options, &exit_code] { exit_code = serve(*options); });
}

}  // namespace berth::commands
