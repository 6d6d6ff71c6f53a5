// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/choose_setup.h"

#include <algorithm>

#include "app/runs/run_files.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/text.h"
#include "common/targets/target.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

/// Of what was chosen by an option, or by a procedure when that is given.
InputError wrong_choice(const std::string& key, const procedures::Procedure* by, int line,
                        const std::string& what) {
  const std::string place =
      by != nullptr ? by->file + ":" + std::to_string(line) + ": key '" + key + "'" : "--" + key;
  return InputError(place + ": " + what);
}

std::string names_in(const fs::path& directory) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(directory)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem());
  }
  std::sort(names.begin(), names.end());
  return joined(names);
}

}  // namespace

std::string default_target(const fs::path& config) {
  return Config::load(config / "testbed.yaml").text("target");
}

RunSetup choose_setup(const SetupChoice& choice, const procedures::Procedure* procedure) {
  RunSetup setup;
  setup.config = choice.config.empty() ? shared_files() / "config" : choice.config;
  if (!fs::is_directory(setup.config / "layouts")) {
    throw InputError("configuration " + setup.config.string() + ": has no layouts/");
  }
  // the procedure's own choice, unless the operator overrides it
  const procedures::Procedure none;
  const procedures::Procedure& own = procedure != nullptr ? *procedure : none;
  const auto* layout_by = choice.layout.empty() && !own.layout.empty() ? procedure : nullptr;
  const auto* target_by = choice.target.empty() && !own.target.empty() ? procedure : nullptr;
  if (const std::string& layout = layout_by ? own.layout : choice.layout; !layout.empty()) {
    setup.layout = layout;
  }
  if (const std::string& target = target_by ? own.target : choice.target; !target.empty()) {
    setup.target = target;
  }
  setup.target_length = choice.target_length;
  if (choice.target.empty() && setup.target_length == 0) setup.target_length = own.target_length;

  if (!fs::exists(setup.layout_file())) {
    throw wrong_choice("layout", layout_by, own.layout_line,
                       "found '" + setup.layout + "', expected one of " + setup.config.string() +
                           "/layouts: " + names_in(setup.config / "layouts"));
  }
  if (setup.target.empty()) {
    setup.target = find_target(default_target(setup.config)).string();
    return setup;
  }
  try {
    setup.target = find_target(setup.target).string();
  } catch (const InputError& e) {
    throw wrong_choice("target", target_by, own.target_line, e.what());
  }
  return setup;
}

std::string choose_world(const SetupChoice& choice, const fs::path& config,
                         const procedures::Procedure* procedure) {
  const auto* by = choice.world.empty() ? procedure : nullptr;
  const std::string& world = by != nullptr ? by->world : choice.world;
  const fs::path worlds = config / "worlds";
  if (!world.empty() && !fs::exists(worlds / (world + ".yaml"))) {
    throw wrong_choice(
        "world", by, by != nullptr ? by->world_line : 0,
        "found '" + world + "', expected one of " + worlds.string() + ": " + names_in(worlds));
  }
  return world;
}

}  // namespace berth
