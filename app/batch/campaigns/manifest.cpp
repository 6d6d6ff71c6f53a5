// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/manifest.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <set>

#include "app/batch/campaigns/vocabulary.h"
#include "app/runs/run_files.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/targets/target.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t max_trials = 1000000000;

Places read_places(Config& config, const Places* given) {
  if (given != nullptr) {
    std::string elsewhere;
    for (const char* key : {"procedure", "config", "target"}) config.optional(key, elsewhere);
    return *given;
  }
  Places places;
  places.config = shared_files() / "config";
  config.optional("procedure", places.procedure);
  config.optional("config", places.config);
  config.optional("target", places.target);
  if (!places.target.empty() && !is_target_name(places.target)) {
    places.target = config.existing("target", places.target).string();
  }
  return places;
}

/// A path may begin with a variable of the environment, "${NAME}/...". Nothing: that is not set.
std::optional<std::string> expanded(const std::string& path) {
  if (path.rfind("${", 0) != 0) return path;
  const auto end = path.find('}');
  if (end == std::string::npos) return path;
  const char* value = std::getenv(path.substr(2, end - 2).c_str());
  if (value == nullptr || *value == '\0') return std::nullopt;
  return value + path.substr(end + 1);
}

/// Reads `targets`; its names become the first axis of the grid.
void read_targets(Config& config, const Places* given, Manifest& manifest) {
  std::vector<Config> items = config.sections("targets");
  if (!config.has("targets")) return;
  for (const char* other : {"target", "target_length"}) {
    if (config.has(other)) throw config.error(other, "expected either this or 'targets'");
  }
  Parameter axis;
  axis.name = target_axis;
  for (Config& item : items) {
    CampaignTarget target;
    const std::string path = item.text("target");
    target.name = fs::path(path).stem().string();
    item.optional("length", Dimension::length, target.length, at_least(0));
    item.finish();
    for (const CampaignTarget& known : manifest.targets) {
      if (known.name == target.name)
        throw item.error("target", "'" + target.name + "' is there twice");
    }
    if (given != nullptr) {
      const auto kept = given->targets.find(target.name);
      if (kept == given->targets.end()) continue;  // was left out
      target.place = kept->second;
    } else if (const auto found = expanded(path); !found) {
      manifest.notes.push_back("target " + path + " is left out: that variable is not set");
      continue;
    } else {
      target.place = is_target_name(*found) ? *found : item.existing("target", *found).string();
    }
    manifest.places.targets[target.name] = target.place;
    Draw value;
    value.texts = {target.name};
    axis.values.push_back({value});
    manifest.targets.push_back(target);
  }
  if (manifest.targets.empty()) throw config.error("targets", "none of them is there");
  manifest.grid.insert(manifest.grid.begin(), axis);
}

void check_names(const Manifest& manifest, Config& config, const Vocabulary& vocabulary) {
  std::set<std::string> names;
  const auto each = [&](const char* key, const std::vector<Parameter>& parameters) {
    Config section = config.has(key) ? config.section(key) : config;
    for (const Parameter& parameter : parameters) {
      if (!names.insert(parameter.name).second) {
        throw section.error(parameter.name, "appears twice among grid, draw and set");
      }
      if (!manifest.targets.empty() && parameter.name == target_axis) continue;
      for (std::size_t i = 0; i < parameter.values.size(); ++i) {
        Random random(manifest.seed, "check");
        try {
          vocabulary.check(parameter.name, draw(parameter, i, random).text);
        } catch (const InputError& e) {
          throw section.error(parameter.name, e.what());
        }
      }
    }
  };
  each("grid", manifest.grid);
  each("draw", manifest.drawn);
  each("set", manifest.fixed);
  for (const std::string& name : vocabulary.required()) {
    if (names.count(name) != 0) continue;
    throw config.error(config.has("grid") ? "grid" : "experiment",
                       "'" + name + "' is missing among grid, draw and set");
  }
}

std::vector<KeptMeasurement> read_measurements(Config& config, const Vocabulary& vocabulary) {
  std::vector<KeptMeasurement> kept;
  for (const std::string& text : config.texts("measurements")) {
    try {
      kept.push_back(vocabulary.measurement(text));
    } catch (const InputError& e) {
      throw config.error("measurements", "'" + text + "': " + e.what());
    }
    const auto same = [&](const KeptMeasurement& m) { return m.name == text; };
    if (std::any_of(kept.begin(), std::prev(kept.end()), same)) {
      throw config.error("measurements", "'" + text + "' appears twice");
    }
  }
  if (kept.empty()) throw config.error("measurements", "expected what is kept of each trial");
  return kept;
}

}  // namespace

std::int64_t Manifest::points() const {
  std::int64_t count = 1;
  for (const Parameter& axis : grid) count *= static_cast<std::int64_t>(axis.values.size());
  return count;
}

std::vector<std::size_t> Manifest::place_of(std::int64_t point) const {
  std::vector<std::size_t> place(grid.size());
  for (std::size_t axis = grid.size(); axis-- > 0;) {
    const auto size = static_cast<std::int64_t>(grid[axis].values.size());
    place[axis] = static_cast<std::size_t>(point % size);
    point /= size;
  }
  return place;
}

CampaignTarget Manifest::target_of(
    const std::vector<std::pair<std::string, std::string>>& parameters) const {
  for (const CampaignTarget& target : targets) {
    for (const auto& [parameter, value] : parameters) {
      if (parameter == target_axis && value == target.name) return target;
    }
  }
  return {"", places.target, target_length};
}

Manifest parse_manifest(const std::string& text, const std::string& file, const Places* places) {
  Manifest manifest;
  manifest.file = file;
  manifest.text = text;
  Config config = Config::parse(text, file);
  manifest.name = fs::path(file).stem().string();
  config.optional("name", manifest.name);
  config.optional("description", manifest.description);
  manifest.experiment = "procedure";
  config.optional_choice("experiment", manifest.experiment,
                         {{"acquisition", "acquisition"}, {"procedure", "procedure"}});
  const bool is_procedure = manifest.experiment == "procedure";
  if (is_procedure != config.has("procedure")) {
    throw config.error(is_procedure ? "procedure" : "experiment",
                       "expected either 'procedure: FILE' or 'experiment: acquisition'");
  }
  manifest.places = read_places(config, places);
  config.optional("target_length", Dimension::length, manifest.target_length, at_least(0));
  if (is_procedure) config.optional("layout", manifest.layout);
  if (is_procedure) config.optional("world", manifest.world);
  std::int64_t seed = 1;
  config.optional("seed", seed, at_least(0));
  manifest.seed = static_cast<std::uint64_t>(seed);
  if (!config.has("trials")) throw config.error("trials", "is missing: how many at each point");
  manifest.trials = config.integer("trials", within(1, max_trials));
  config.optional("block", manifest.block, within(1, max_trials));
  config.optional("trial_limit", Dimension::time, manifest.trial_limit_s, above(0));
  manifest.grid = read_grid(config);
  read_targets(config, places, manifest);
  manifest.drawn = read_drawn(config);
  manifest.fixed = read_fixed(config);
  const auto vocabulary = is_procedure ? vocabulary_of_procedure(manifest.places)
                                       : vocabulary_of_acquisition(manifest.places);
  check_names(manifest, config, *vocabulary);
  manifest.measurements = read_measurements(config, *vocabulary);
  config.finish();
  if (manifest.points() > max_trials / manifest.trials) {
    throw config.error("trials", "there are more than 1000000000 trials in all");
  }
  return manifest;
}

Manifest load_manifest(const fs::path& file) {
  return parse_manifest(read_file(file), file.string());
}

}  // namespace berth::campaigns
