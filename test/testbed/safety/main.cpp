// SPDX-License-Identifier: BSD-3-Clause
// Runs every drill over several seeds and instants of the motion, and writes the table of
// test/benchmarks/safety.md: safety_drills [--seeds N] [--only NAME] [--table FILE]
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/file.h"
#include "common/core/random.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "test/testbed/safety/drill.h"

namespace {

using namespace berth;
using namespace berth::drills;

struct Range {
  double min = 1e9;
  double max = -1e9;
  void add(double value) {
    min = std::min(min, value);
    max = std::max(max, value);
  }
  std::string milliseconds() const {
    const std::string low = fixed(1e3 * min, 0);
    const std::string high = fixed(1e3 * max, 0);
    return low == high ? low : low + " to " + high;
  }
};

struct Row {
  Range seen, braking, at_rest, clearance;
  std::string code;
  std::string text;
  std::string state;
};

std::string state_name(std::int8_t state) {
  constexpr const char* names[] = {"NOT_READY", "IDLE", "MOVING", "CLOSED_LOOP",
                                   "HOLDING",   "HELD", "FAULT"};
  return state >= 0 && state <= testbed_state_t::FAULT ? names[state] : "?";
}

}  // namespace

int main(int argc, char* argv[]) {
  CLI::App options("Safety drills in the twin", "safety_drills");
  int seeds = 3;
  std::string only;
  std::string table;
  options.add_option("--seeds", seeds, "How often, each time elsewhere in the motion")
      ->capture_default_str();
  options.add_option("--only", only, "The drills whose name holds this");
  options.add_option("--table", table, "Where the table is written, as Markdown");
  CLI11_PARSE(options, argc, argv);

  int broken = 0;
  Table drills_table{"llrrrrll",
                     {"fault", "the operator reads", "seen after, ms", "braking after, ms",
                      "standing after, ms", "least clearance, mm", "the cell", "goes on"}};
  for (const Drill& drill : drills::drills()) {
    if (!only.empty() && drill.name.find(only) == std::string::npos) continue;
    Row row;
    for (int seed = 1; seed <= seeds; ++seed) {
      Random random(static_cast<std::uint64_t>(seed), drill.name);
      const Outcome outcome =
          drills::run(drill, static_cast<std::uint64_t>(seed), 2 * random.uniform());
      const std::string wrong = verdict(drill, outcome);
      row.seen.add(outcome.seen);
      row.braking.add(outcome.braking);
      row.at_rest.add(outcome.at_rest);
      row.clearance.add(outcome.min_clearance);
      row.code = outcome.code;
      row.text = outcome.text;
      row.state = state_name(outcome.state);
      std::printf(
          "%-38s %d  sign %5.0f  seen %4.0f  held %4.0f  braking %4.0f  standing %5.0f ms  "
          "%4.0f mm  %-9s %s: %s%s\n",
          drill.name.c_str(), seed, 1e3 * outcome.first_sign, 1e3 * outcome.seen,
          1e3 * outcome.held, 1e3 * outcome.braking, 1e3 * outcome.at_rest,
          1e3 * outcome.min_clearance, row.state.c_str(), outcome.code.c_str(),
          outcome.text.c_str(), wrong.empty() ? "" : ("\n    BROKEN: " + wrong).c_str());
      std::fflush(stdout);
      broken += wrong.empty() ? 0 : 1;
    }
    drills_table.rows.push_back({drill.name, "`" + row.code + "`: " + row.text,
                                 row.seen.milliseconds(), row.braking.milliseconds(),
                                 row.at_rest.milliseconds(), fixed(1e3 * row.clearance.min, 0),
                                 row.state, drill.resumes});
  }
  if (!table.empty()) write_file(table, markdown_table(drills_table));
  std::printf(broken == 0 ? "all promises kept\n" : "%d promises broken\n", broken);
  return broken == 0 ? 0 : 1;
}
