// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/excerpt.h"

#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>

#include "app/commands/log/verbs.h"
#include "app/exit_code.h"
#include "common/core/error.h"
#include "evaluation/run/place_in_log.h"
#include "logs/file/timeline.h"

namespace berth::commands::log {
namespace {

namespace fs = std::filesystem;

int write(const fs::path& in, const fs::path& out, const logs::Excerpt& excerpt) {
  const logs::ExcerptResult result = logs::write_excerpt(in, out, excerpt);
  std::printf("%s: %" PRId64 " messages, %" PRId64 " left out\n", out.c_str(), result.written,
              result.left_out);
  if (result.damaged_bytes > 0) {
    std::fprintf(stderr, "berth: %s: %zu damaged bytes were passed over\n", in.c_str(),
                 result.damaged_bytes);
  }
  if (excerpt.from || excerpt.to) {
    for (const logs::TimeStep& step : result.steps) {
      std::fprintf(stderr, "berth: %s: %s; times are counted as they were recorded\n", in.c_str(),
                   step.text().c_str());
    }
  }
  return exit_code::passed;
}

struct CutOptions {
  fs::path out;
  std::string from;
  std::string to;
  std::string keep;
};

int cut(const fs::path& in, const CutOptions& options) {
  logs::Excerpt excerpt;
  if (options.from.empty() && options.to.empty()) throw InputError("cut: expected --from or --to");
  logs::LogReader reader(in);
  const logs::Timeline timeline(reader);
  if (timeline.empty()) throw InputError(in.string() + ": holds no message");
  if (!options.from.empty()) {
    excerpt.from = evaluation::place_in_log(in, timeline, options.from, false);
  }
  if (!options.to.empty()) excerpt.to = evaluation::place_in_log(in, timeline, options.to, true);
  if (excerpt.from && excerpt.to && *excerpt.to < *excerpt.from) {
    throw InputError("cut: --to '" + options.to + "' is before --from '" + options.from + "'");
  }
  excerpt.keep = options.keep;
  return write(in, options.out, excerpt);
}

}  // namespace

void add_cut(CLI::App& log, int& exit_code) {
  auto* command = log.add_subcommand(
      "cut",
      "Write a stretch of time into a new log. Times are seconds after the log's start (12.5), a\n"
      "utime, or a phase of the procedure: its start with --from, its end with --to");
  auto file = add_log_argument(*command);
  auto options = std::make_shared<CutOptions>();
  command->add_option("--from", options->from, "Time");
  command->add_option("--to", options->to, "Time");
  command->add_option("--keep", options->keep,
                      "Channels (regular expression) that are written whole, such as RUN_INFO");
  command->add_option("--out", options->out, "New log; must not be there yet")->required();
  command->callback([=, &exit_code] { exit_code = cut(log_of_run(*file), *options); });
}

void add_filter(CLI::App& log, int& exit_code) {
  auto* command = log.add_subcommand(
      "filter", "Write some channels into a new log; regular expressions match whole names");
  auto file = add_log_argument(*command);
  auto excerpt = std::make_shared<logs::Excerpt>();
  auto out = std::make_shared<fs::path>();
  auto* include = command->add_option("--include", excerpt->include, "Only these channels");
  auto* exclude = command->add_option("--exclude", excerpt->exclude, "All but these");
  command->add_option("--out", *out, "New log; must not be there yet")->required();
  command->callback([=, &exit_code] {
    if (include->empty() && exclude->empty()) {
      throw InputError("filter: expected --include or --exclude");
    }
    exit_code = write(log_of_run(*file), *out, *excerpt);
  });
}

}  // namespace berth::commands::log
