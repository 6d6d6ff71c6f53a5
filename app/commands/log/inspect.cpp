// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cinttypes>
#include <cstdio>
#include <map>

#include "app/commands/log/verbs.h"
#include "app/exit_code.h"
#include "app/terminal/progress_line.h"
#include "common/core/valid_text.h"
#include "logs/inspect/inspection.h"
#include "logs/inspect/repair.h"

namespace berth::commands::log {
namespace {

/// types must outlive what comes back.
logs::Inspection read(const std::filesystem::path& log, const logs::TypeCatalogue& types) {
  terminal::ProgressLine progress(log.string());
  return logs::inspect(log, types, [&](double share) { progress.show(share); });
}

/// Of each kind and channel the first ten; --json has up to a hundred.
void print(const std::vector<logs::Finding>& findings) {
  std::map<std::pair<logs::Finding::Kind, std::string>, int> shown;
  for (const logs::Finding& finding : findings) {
    const int count = ++shown[{finding.kind, finding.channel}];
    if (count <= 10) print_text(finding.text() + "\n");
    if (count == 11) {
      const std::string on = finding.channel.empty() ? "" : " on " + terminal_line(finding.channel);
      print_text("... and more of this kind" + on + "\n");
    }
  }
}

int info(const std::filesystem::path& log, const Paths& types, bool json) {
  const logs::TypeCatalogue catalogue = types_of({log}, types);
  const logs::Inspection inspection = read(log, catalogue);
  if (json) {
    std::printf("%s\n", json_text(json_of(inspection), 2).c_str());
  } else {
    print_text(text_of(inspection));
  }
  return inspection.damaged_bytes > 0 ? exit_code::failed : exit_code::passed;
}

int check(const std::filesystem::path& log, const Paths& types, bool gaps_count, bool json) {
  const logs::TypeCatalogue catalogue = types_of({log}, types);
  const logs::Inspection i = read(log, catalogue);
  const bool sound = i.sound(gaps_count);
  if (json) {
    std::printf("%s\n", json_text(json_of(i), 2).c_str());
  } else {
    print(i.findings);
    std::printf("%s %s: %" PRId64 " messages, %s\n", sound ? "ok  " : "BAD ", i.file.c_str(),
                i.events, summary_of(i).c_str());
  }
  return sound ? exit_code::passed : exit_code::failed;
}

int repair(const std::filesystem::path& in, const std::filesystem::path& out, const Paths& types) {
  const logs::Repair repair = logs::repair(in, out, types_of({in}, types));
  for (const logs::Finding& finding : repair.findings) {
    print_text("left out: " + finding.text() + "\n");
  }
  std::printf("%s: %" PRId64 " events written; left out: %zu damaged bytes, %" PRId64
              " undecodable messages\n",
              out.c_str(), repair.written, repair.damaged_bytes, repair.dropped);
  return exit_code::passed;
}

}  // namespace

void add_info(CLI::App& log, int& exit_code) {
  auto* command = log.add_subcommand(
      "info", "Channels, types, rates, sizes, pauses, gaps, sessions; exit code 1 if damaged");
  auto file = add_log_argument(*command);
  auto types = add_types_option(*command);
  auto json = std::make_shared<bool>(false);
  command->add_flag("--json", *json, "JSON instead of a table");
  command->callback([=, &exit_code] { exit_code = info(log_of_run(*file), *types, *json); });
}

void add_check(CLI::App& log, int& exit_code) {
  auto* command = log.add_subcommand(
      "check",
      "Is the log whole? Says where it is damaged, where messages are missing and which "
      "do not decode; exit code 1 if any");
  auto file = add_log_argument(*command);
  auto types = add_types_option(*command);
  auto ignore_gaps = std::make_shared<bool>(false);
  auto json = std::make_shared<bool>(false);
  command->add_flag("--ignore-gaps", *ignore_gaps,
                    "Missing messages are reported, but no fault: for a repaired log");
  command->add_flag("--json", *json, "JSON instead of lines");
  command->callback(
      [=, &exit_code] { exit_code = check(log_of_run(*file), *types, !*ignore_gaps, *json); });
}

void add_repair(CLI::App& log, int& exit_code) {
  auto* command = log.add_subcommand(
      "repair", "Write what is good of a damaged log into a new one, and report what was left out");
  auto in = add_log_argument(*command, "in");
  auto out = std::make_shared<std::filesystem::path>();
  command->add_option("out", *out, "New log; must not be there yet")->required();
  auto types = add_types_option(*command);
  command->callback([=, &exit_code] { exit_code = repair(log_of_run(*in), *out, *types); });
}

}  // namespace berth::commands::log
