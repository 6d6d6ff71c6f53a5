// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/plan.h"

#include <algorithm>
#include <cctype>
#include <set>

#include "app/runs/config_override.h"
#include "common/core/config.h"
#include "common/core/file.h"
#include "common/core/random.h"
#include "common/core/yaml_text.h"
#include "common/targets/target.h"
#include "procedures/language/procedure.h"

namespace berth::nights {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t max_seeds = 10000;

struct Seeds {
  std::vector<std::uint64_t> fixed;
  int fresh = 0;
};

/// `fixed: 12` means the seeds 1 to 12, `fixed: [3, 5]` just these.
std::vector<std::uint64_t> read_fixed(Config& config) {
  std::vector<std::uint64_t> seeds;
  const auto add = [&](std::int64_t seed) {
    if (seed < 0) throw config.error("fixed", "found a negative seed");
    const auto value = static_cast<std::uint64_t>(seed);
    if (std::find(seeds.begin(), seeds.end(), value) != seeds.end()) {
      throw config.error("fixed", "the seed " + std::to_string(seed) + " appears twice");
    }
    seeds.push_back(value);
  };
  if (config.raw("fixed", "whole number, or list of them").is_list()) {
    const auto list = config.integers("fixed");
    if (std::ssize(list) > max_seeds) throw config.error("fixed", "expected at most 10000 seeds");
    for (const std::int64_t seed : list) add(seed);
    return seeds;
  }
  std::int64_t last = 0;
  config.optional("fixed", last, within(0, max_seeds));
  for (std::int64_t seed = 1; seed <= last; ++seed) add(seed);
  return seeds;
}

Seeds read_seeds(Config& parent, const Seeds& otherwise) {
  Config config = parent.optional_section("seeds");
  Seeds seeds;
  seeds.fixed = read_fixed(config);
  config.optional("fresh", seeds.fresh, within(0, max_seeds));
  config.finish();
  return parent.has("seeds") ? seeds : otherwise;
}

/// A list of words, or one word; one empty word when the key is missing.
std::vector<std::string> words(Config& config, const std::string& key) {
  std::vector<std::string> list;
  if (config.raw(key, "text, or list of texts").is_text()) return {config.text(key)};
  config.optional(key, list);
  if (list.empty() && config.has(key)) throw config.error(key, "found an empty list");
  if (list.empty()) list.emplace_back();
  return list;
}

std::vector<Case> read_cases(Config& config, const Seeds& default_seeds) {
  Case common;
  common.procedure = config.existing("procedure", config.text("procedure"));
  config.optional("may_fail", common.may_fail, at_least(0).below(1));
  const Seeds seeds = read_seeds(config, default_seeds);
  common.fixed = seeds.fixed;
  common.fresh = seeds.fresh;
  if (seeds.fixed.empty() && seeds.fresh == 0) {
    throw config.error(config.has("seeds") ? "seeds" : "procedure", "no seeds, so it never runs");
  }
  for (const auto& [name, value] : config.optional_section("set").named_values("value")) {
    common.parameters[name] = plain_text(value);
  }
  std::string name = common.procedure.stem().string();
  config.optional("estimator", common.estimator);
  if (!common.estimator.empty()) name += " by " + common.estimator.stem().string();
  config.optional("name", name);

  std::vector<Case> cases;
  const auto hosts = words(config, "hosts");
  const auto worlds = words(config, "worlds");
  const auto directories = words(config, "configs");
  for (const auto& target : words(config, "targets")) {
    for (const auto& host : hosts) {
      for (const auto& world : worlds) {
        for (const auto& directory : directories) {
          Case one = common;
          one.name = name;
          one.target = target;
          if (!target.empty() && !is_target_name(target)) {
            one.target = config.existing("targets", target).string();
          }
          if (!target.empty()) one.name += " " + fs::path(target).stem().string();
          if (!host.empty()) one.host = host;
          if (one.host != "twin" && one.host != "simulated-cell" && one.host != "cell") {
            throw config.error("hosts",
                               "found '" + host + "', expected twin, simulated-cell or cell");
          }
          if (one.host != "twin") one.name += " on " + one.host;
          one.world = world;
          if (!world.empty()) one.parameters["simulation.yaml:world"] = world;
          if (!one.is_compared()) one.name += " in " + world;
          if (!directory.empty()) {
            one.config = config.existing("configs", directory);
            one.name += " with " + fs::path(directory).filename().string();
          }
          cases.push_back(one);
        }
      }
    }
  }
  config.finish();
  return cases;
}

evaluation::MinimumEffect read_minimum_effect(Config& parent) {
  evaluation::MinimumEffect minimum;
  Config config = parent.optional_section("minimum_effect");
  const std::map<std::string, Dimension> keys = {{"length", Dimension::length},
                                                 {"angle", Dimension::angle},
                                                 {"time", Dimension::time},
                                                 {"speed", Dimension::speed},
                                                 {"angular_speed", Dimension::angular_speed},
                                                 {"frequency", Dimension::frequency},
                                                 {"number", Dimension::number}};
  config.optional("relative", minimum.relative, at_least(0).below(1));
  for (const auto& [key, dimension] : keys) {
    config.optional(key, dimension, minimum.absolute[dimension], at_least(0));
  }
  config.finish();
  return minimum;
}

Baseline read_baseline(Config& parent) {
  Baseline baseline;
  Config config = parent.optional_section("baseline");
  config.optional("build", baseline.build);
  config.optional("config", baseline.config);
  if (!config.has("build") && parent.has("baseline")) throw config.error("build", "is missing");
  config.finish();
  return baseline;
}

Archive read_archive(Config& parent) {
  Archive archive;
  Config config = parent.optional_section("archive");
  config.optional("runs", archive.runs);
  config.optional("config", archive.config);
  config.finish();
  if (!parent.has("archive")) return archive;
  if (archive.runs.empty()) throw config.error("runs", "is missing");
  if (!fs::is_directory(archive.runs) ||
      std::none_of(fs::directory_iterator(archive.runs), fs::directory_iterator(),
                   [](const auto& entry) { return entry.is_directory(); })) {
    throw config.error(
        "runs", "found '" + archive.runs.string() + "', expected a directory of run directories");
  }
  return archive;
}

/// Random seeds, above the range that people write down, and exact in JSON.
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

Plan load_plan(const fs::path& file) {
  Plan plan;
  plan.file = fs::absolute(file);
  plan.text = read_file(file);
  Config config = Config::parse(plan.text, file.string());
  plan.name = file.stem().string();
  config.optional("name", plan.name);
  config.optional("jobs", plan.jobs, at_least(1));
  config.optional("time_budget", Dimension::time, plan.time_budget_s, above(0));
  config.optional("run_timeout", Dimension::time, plan.run_timeout_s, above(0));
  config.optional("notify", plan.notify);
  config.optional("keep", plan.keep, at_least(0));
  config.optional("history", plan.history_nights, at_least(1));
  config.optional("family_wise_alpha", plan.family_wise_alpha, above(0).below(1));
  plan.minimum_effect = read_minimum_effect(config);
  plan.baseline = read_baseline(config);
  plan.archive = read_archive(config);
  const Seeds seeds = read_seeds(config, {});

  auto sections = config.sections("procedures");
  if (sections.empty()) throw config.error("procedures", "expected a list of procedures to run");
  std::set<std::string> names;
  for (Config& section : sections) {
    for (Case& one : read_cases(section, seeds)) {
      if (!names.insert(one.name).second) {
        throw section.error("procedure", "the name '" + one.name +
                                             "' appears twice in the plan: give one a `name`");
      }
      plan.cases.push_back(std::move(one));
    }
  }
  config.finish();
  return plan;
}

std::vector<evaluation::Criterion> criteria_of(const Case& of) {
  return procedures::load_procedure(of.procedure, of_procedure(of.parameters)).criteria;
}

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
  std::size_t max_cases = 0;
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
    max_cases = std::max(max_cases, list.size());
  }
  std::vector<PlannedRun> runs;
  for (std::size_t turn = 0; turn < max_cases; ++turn) {
    for (const auto& list : lists) {
      if (turn < list.size()) runs.push_back(list[turn]);
    }
  }
  return runs;
}

}  // namespace berth::nights
