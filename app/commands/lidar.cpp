// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "common/core/valid_text.h"
#include "drivers/lidar/conformance.h"

namespace berth::commands {
namespace {

using lidar::ConformanceCheck;

const char* word_of(ConformanceCheck::Outcome outcome) {
  switch (outcome) {
    case ConformanceCheck::Outcome::ok:
      return "ok";
    case ConformanceCheck::Outcome::failed:
      return "fail";
    case ConformanceCheck::Outcome::skipped:
      break;
  }
  return "skip";
}

int test(const std::string& address) {
  int counts[3] = {0, 0, 0};
  const auto report = [&](const ConformanceCheck& check) {
    ++counts[static_cast<int>(check.outcome)];
    std::string line = word_of(check.outcome);
    line.resize(6, ' ');
    line += check.name;
    line.resize(std::max<std::size_t>(line.size() + 2, 50), ' ');
    print_text(line + check.found + "\n", stdout);
    if (!check.mend.empty()) print_text("      mend: " + check.mend + "\n", stdout);
    std::fflush(stdout);
  };
  const bool good = lidar::test_conformance(address, report);
  std::printf("%d ok, %d failed, %d skipped\n", counts[0], counts[1], counts[2]);
  return good ? exit_code::passed : exit_code::failed;
}

}  // namespace

void add_lidar(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("lidar", "Try a LIDAR or a bridge out, without a cell");
  command->require_subcommand(1);
  auto* sub = command->add_subcommand(
      "test", "Test a device or bridge against the LIDAR protocol (drivers/lidar/PROTOCOL.md)");
  auto address = std::make_shared<std::string>();
  sub->add_option("address", *address, "Where it listens, as 127.0.0.1:15024")->required();
  sub->footer(
      "Speaks to it as the driver does, and as no driver should: each message, the limits, the\n"
      "refusals, round trips, the cadence and the stamps of returns, versions 1 and 2. A line for\n"
      "each check, and below one that failed what mends it. THE LIDAR SCANS, some ten seconds in\n"
      "all, with windows of a quarter of its field of view. No other host may be connected.\n"
      "Exit codes: 0 all that was tested is as it should be, 1 a check failed, 2 no answer.");
  sub->callback([address, &exit_code] { exit_code = test(*address); });
}

}  // namespace berth::commands
