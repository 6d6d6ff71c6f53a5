// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/planned_run.h"

#include <algorithm>
#include <cctype>

#include "common/core/random.h"

namespace berth::nights {
namespace {

/// Seeds nobody chose: above all that people write down, and exact in JSON.
std::vector<std::uint64_t> fresh_seeds(const Plan& plan, const Case& of, std::int64_t night) {
  Random random(static_cast<std::uint64_t>(night), "fresh seeds of " + plan.name + ", " + of.name);
  std::vector<std::uint64_t> seeds;
  while (seeds.size() < static_cast<std::size_t>(of.fresh)) {
    const std::uint64_t seed = 1000000 + random.bits() % 1000000000;
    if (std::find(seeds.begin(), seeds.end(), seed) == seeds.end()) seeds.push_back(seed);
  }
  return seeds;
}

}  // namespace

const char* name_of(Build build) { return build == Build::tonight ? "tonight" : "baseline"; }

std::string PlannedRun::name() const {
  std::string text = of->name;
  for (char& c : text) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '_' && c != '-' && c != '.') c = '_';
  }
  text += "-seed" + std::to_string(seed);
  return build == Build::baseline ? text + "-baseline" : text;
}

std::vector<PlannedRun> runs_of_night(const Plan& plan, std::int64_t night_number) {
  std::vector<std::vector<PlannedRun>> lists;
  std::size_t longest = 0;
  for (const Case& of : plan.cases) {
    auto& list = lists.emplace_back();
    for (const std::uint64_t seed : of.fixed) {
      list.push_back({&of, Build::tonight, seed, false});
      if (!plan.baseline.build.empty() && of.host == "twin" && of.is_compared()) {
        list.push_back({&of, Build::baseline, seed, false});
      }
    }
    for (const std::uint64_t seed : fresh_seeds(plan, of, night_number)) {
      list.push_back({&of, Build::tonight, seed, true});
    }
    longest = std::max(longest, list.size());
  }
  std::vector<PlannedRun> runs;
  for (std::size_t turn = 0; turn < longest; ++turn) {
    for (const auto& list : lists) {
      if (turn < list.size()) runs.push_back(list[turn]);
    }
  }
  return runs;
}

}  // namespace berth::nights
