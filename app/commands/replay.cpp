// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/replay.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "app/commands/commands.h"
#include "common/core/error.h"
#include "common/core/quantity.h"

namespace berth::commands {
namespace {

struct ReplayOptions {
  ReplayRequest request;
  std::string from;
  std::string to;
};

/// "12.5", "12.5 s" or "2 min".
Utime time_of(const std::string& option, const std::string& text) {
  if (text.empty()) return 0;
  const bool has_unit = text.find_first_of("smhu") != std::string::npos;
  try {
    const double value = parse_quantity(text + (has_unit ? "" : " s"), Dimension::time);
    if (value < 0) throw InputError("must not be negative");
    return utime_from_seconds(value);
  } catch (const InputError& error) {
    throw InputError(option + " " + text + ": " + error.what());
  }
}

void complete(ReplayOptions& options) {
  ReplayRequest& request = options.request;
  request.player.from = time_of("--from", options.from);
  request.player.to = time_of("--to", options.to);
  if (request.player.to != 0 && request.player.to <= request.player.from) {
    throw InputError("--to " + options.to + ": must be after --from");
  }
  const bool changed = !request.config.empty() || !request.set.empty();
  if (changed && !request.estimate) {
    throw InputError("--config and --set are for the estimator that --estimate starts");
  }
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "replay", "Play a log onto a bus, with keys to pause, step and seek in a terminal");
  auto options = std::make_shared<ReplayOptions>();
  ReplayRequest& request = options->request;
  command->add_option("run", request.run, "Run directory, log, name of a run in runs/, or 'last'")
      ->required();
  command->add_option("--lcm-url", request.url, "LCM URL of the bus to play onto");
  command->add_option("--rate", request.player.rate, "Times real time")
      ->check(CLI::Range(1.0 / 64, 1024.0))
      ->capture_default_str();
  command->add_option("--from", options->from, "Begin so long after the log's start, e.g. 90 s")
      ->type_name("TIME");
  command->add_option("--to", options->to, "End so long after the log's start")->type_name("TIME");
  command->add_flag("--loop", request.player.loop, "Begin again at the end");
  command->add_option("--remap", request.remap, "Play a channel under another name")
      ->type_name("FROM=TO");
  command->add_option("--only", request.only, "Only channels that match")->type_name("REGEXP");
  command->add_option("--without", request.without, "No channels that match")->type_name("REGEXP");
  command->add_flag("--estimate", request.estimate,
                    "Run an estimator alongside, on the recorded scans; the recorded estimates go "
                    "out as " +
                        std::string(recorded_estimate_channel));
  command->add_option("--config", request.config,
                      "Of that estimator: an estimator.yaml, or a configuration directory");
  command->add_option("--set", request.set, "Of that estimator: a key of estimator.yaml")
      ->type_name("KEY=VALUE");
  command->add_flag("--force", request.force, "Play even where a cell is alive on the bus");
  command->callback([options, &exit_code] {
    complete(*options);
    exit_code = replay(options->request);
  });
}

}  // namespace berth::commands
