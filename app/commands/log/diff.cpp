// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>

#include "app/commands/log/verbs.h"
#include "app/exit_code.h"
#include "common/core/valid_text.h"
#include "logs/inspect/log_diff.h"
#include "logs/types/value.h"

namespace berth::commands::log {
namespace {

int diff(const std::filesystem::path& a, const std::filesystem::path& b, const Paths& given,
         const logs::DiffOptions& options, bool json) {
  const logs::TypeCatalogue types = types_of({a, b}, given);
  const logs::LogDiff diff = logs::diff_logs(a, b, types, options);
  if (json) {
    std::printf("%s\n", json_text(json_of(diff), 2).c_str());
  } else {
    print_text(text_of(diff) + (equal(diff) ? "same\n" : "DIFFERENT\n"));
  }
  return equal(diff) ? exit_code::passed : exit_code::failed;
}

}  // namespace

void add_diff(CLI::App& log, int& exit_code) {
  auto* command = log.add_subcommand(
      "diff",
      "Compare two logs channel by channel, message by message (by seq and sender); exit code 1\n"
      "when they differ. When the logger received a message never counts");
  auto a = add_log_argument(*command, "a");
  auto b = add_log_argument(*command, "b");
  auto options = std::make_shared<logs::DiffOptions>();
  auto json = std::make_shared<bool>(false);
  command->add_flag("--ignore-times", options->ignore_times,
                    "Fields of wall-clock time and the session do not count");
  command->add_option("--ignore", options->ignore_fields,
                      "Fields that do not count: regular expression of whole paths, as "
                      "'.*_us|counters.*'");
  command
      ->add_option("--tolerance", options->tolerance,
                   "Real numbers may differ by so much (in the field's own unit)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--channels", options->channels, "Only these channels (regular expression)");
  command->add_flag("--json", *json, "JSON instead of a table");
  auto types = add_types_option(*command);
  command->callback([=, &exit_code] {
    exit_code = diff(log_of_run(*a), log_of_run(*b), *types, *options, *json);
  });
}

}  // namespace berth::commands::log
