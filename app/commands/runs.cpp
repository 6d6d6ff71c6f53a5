// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/manifest.h"
#include "app/runs/run_list.h"
#include "common/core/error.h"
#include "common/core/nan.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct RunsOptions {
  fs::path directory = "runs";
  RunFilter filter;
  std::size_t limit = 0;
  bool json = false;
  bool verify = false;
};

std::string text_of_size(std::uintmax_t bytes) {
  constexpr double kilo = 1000;
  const auto size = static_cast<double>(bytes);
  if (size >= kilo * kilo * kilo) return fixed(size / kilo / kilo / kilo, 1) + " GB";
  return fixed(size / kilo / kilo, 1) + " MB";
}

std::string text_of_margin(const RunEntry& run) {
  if (run.worst_criterion.empty()) return "";
  return shown(run.worst_margin) + " " + run.worst_unit + " (" + run.worst_criterion + ")";
}

Table table_of(const std::vector<RunEntry>& runs) {
  Table table{
      "llllrl",
      {"run", json_only("directory"), json_only("created"), "host", json_only("operator"),
       json_only("procedure"), json_only("layout"), "target", json_only("seed"),
       json_only("version"), "outcome", json_only("reason"), keyed("duration", "duration_s"),
       json_only("worst_criterion"), keyed("worst margin", "worst_margin"),
       json_only("worst_margin_unit"), keyed("size", "bytes")}};
  for (const RunEntry& run : runs) {
    table.rows.push_back(
        {{run.name(), run.directory.string(), run.created, run.host, run.operator_name,
          run.procedure, run.layout, run.target, run.seed, run.version, state_text(run), run.reason,
          valued(std::isnan(run.duration_s) ? "" : fixed(run.duration_s, 0) + " s", run.duration_s),
          run.worst_criterion,
          valued(text_of_margin(run), run.worst_criterion.empty() ? nan : run.worst_margin),
          run.worst_unit, valued(text_of_size(run.bytes), run.bytes)},
         Table::none,
         run.name(),
         run.reason});
  }
  return table;
}

int verify(const std::vector<RunEntry>& runs) {
  int code = exit_code::passed;
  for (const RunEntry& run : runs) {
    if (run.state == RunEntry::State::running) continue;
    std::vector<std::string> problems;
    try {
      problems = verify_checksums(run.directory);
    } catch (const InputError& e) {
      problems.emplace_back(e.what());
    }
    print_text(run.name() + ": " + (problems.empty() ? "as it was written" : "CHANGED") + "\n");
    for (const std::string& problem : problems) print_text("  " + problem + "\n");
    if (!problems.empty()) code = exit_code::error;
  }
  return code;
}

int runs(const RunsOptions& options) {
  // A run directory, or one that holds some.
  const bool one = fs::exists(options.directory / "run.yaml");
  const std::vector<RunEntry> all =
      one ? std::vector<RunEntry>{read_run_entry(options.directory)} : list_runs(options.directory);
  const std::vector<RunEntry> found = matching(all, options.filter, options.limit);
  if (options.verify) return verify(found);
  if (found.empty() && !options.json) {
    std::printf("no runs in %s%s\n", options.directory.c_str(), all.empty() ? "" : " that match");
  } else {
    print_table(table_of(found), options.json);
  }
  return exit_code::passed;
}

}  // namespace

void add_runs(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("runs", "List and find runs; check that they are unchanged");
  auto options = std::make_shared<RunsOptions>();
  command->add_option("directory", options->directory, "Where the runs are, or one run")
      ->capture_default_str();
  command->add_option("--procedure", options->filter.procedure, "Only those of this procedure");
  command->add_option("--outcome", options->filter.outcome,
                      "Only PASS, FAIL, ERROR, TIMEOUT, ABORTED, INCONCLUSIVE, RUNNING or "
                      "UNFINISHED");
  command->add_option("--since", options->filter.since,
                      "Only those made since a date (UTC) such as 2026-11-20, or within '12 h' or "
                      "'3 days'");
  command->add_option("--host", options->filter.host, "Only twin, simulated-cell or cell");
  command->add_option("--limit", options->limit, "Only the newest N");
  command->add_flag("--json", options->json, "JSON instead of a table");
  command->add_flag("--verify", options->verify, "Check the files against SHA256SUMS");
  command->callback([options, &exit_code] { exit_code = runs(*options); });
}

}  // namespace berth::commands
