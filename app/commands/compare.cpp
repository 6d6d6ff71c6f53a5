// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "common/core/error.h"
#include "logs/compare/comparison.h"
#include "logs/compare/plot.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct Options {
  std::vector<fs::path> runs;
  bool json = false;
  fs::path plot;
};

fs::path log_of(const fs::path& run) { return fs::is_directory(run) ? run / "run.lcm" : run; }

int compare(const Options& options) {
  int worst = exit_code::passed;
  for (const auto& run : options.runs) {
    const fs::path log = log_of(run);
    const logs::ComparedRun compared = logs::compare_run(log);
    const logs::Comparison& comparison = compared.comparison;
    std::printf("%s\n",
                (options.json ? logs::json_of(comparison) : logs::text_of(comparison)).c_str());
    if (!options.plot.empty() && !logs::write_plot(compared.record, options.plot)) {
      throw InputError("no plot: gnuplot is missing or failed (apt-get install gnuplot-nox)");
    }
    worst = std::max(worst, logs::exit_code_of_outcome(comparison.outcome));
  }
  return worst;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "compare", "Compare estimates with ground truth and recompute the verdict, from a log alone");
  auto options = std::make_shared<Options>();
  command->add_option("run", options->runs, "Run directories or logs")->required();
  command->add_flag("--json", options->json, "JSON instead of tables");
  command->add_option("--plot", options->plot, "Draw estimate, truth and errors into this SVG");
  command->callback([options, &exit_code] { exit_code = compare(*options); });
}

}  // namespace berth::commands
