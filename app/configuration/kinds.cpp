// SPDX-License-Identifier: BSD-3-Clause
#include "app/configuration/kinds.h"

#include <fnmatch.h>
#include <glob.h>

#include <iterator>

#include "app/batch/campaigns/manifest.h"
#include "app/batch/campaigns/slurm.h"
#include "app/batch/nights/plan.h"
#include "app/console/serving.h"
#include "app/runs/choose_setup.h"
#include "app/runs/twin_host.h"
#include "common/core/error.h"
#include "common/core/lidar_profile.h"
#include "common/core/reflectors.h"
#include "common/core/shared_files.h"
#include "common/core/text.h"
#include "common/targets/target_file.h"
#include "drivers/arm/register_map.h"
#include "drivers/devices.h"
#include "drivers/facility/plc_map.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "drivers/simulated/receiver/receiver.h"
#include "drivers/simulated/simulation_settings.h"
#include "estimator/estimator_options.h"
#include "testbed/calibration/parameters.h"
#include "testbed/guidance/profile.h"
#include "testbed/settings.h"

namespace berth {
namespace {

namespace fs = std::filesystem;

void read_layout(const fs::path& file) {
  load_cell(file, load_target(find_target("radarsat2").string(), 0));
}

void read_testbed(const fs::path& file) {
  testbed::load_settings(file);
  default_target(file.parent_path());
}

void read_lidar(const fs::path& file) {
  load_lidar_profile(file);
  ReceiverSettings receiver;
  read_receiver(file, receiver);
}

}  // namespace

const std::vector<ConfigKind>& config_kinds() {
  static const auto at = [](const std::string& name, const std::string& files,
                            const std::string& what, std::function<void(const fs::path&)> read) {
    return ConfigKind{name, files, what,
                      name == "target" ? "targets/schema.json" : "schemas/" + name + ".json",
                      std::move(read)};
  };
  static const std::vector<ConfigKind> all = {
      at("estimator", "config/estimator*.yaml", "the pose estimator",
         [](const fs::path& file) { estimator::load_estimator_options(file); }),
      at("testbed", "config/testbed.yaml", "motion, guidance, ground truth and safety",
         read_testbed),
      at("guidance", "config/guidance/*.yaml", "profiles of an approach",
         [](const fs::path& file) { testbed::load_guidance_profile(file); }),
      at("layout", "config/layouts/*.yaml", "where arms, target and room are", read_layout),
      at("arm", "config/arms/*.yaml", "kinematics and bodies of an arm",
         [](const fs::path& file) { ArmKinematics::load(file); }),
      at("lidar", "config/lidars/*.yaml", "limits and beam of a LIDAR", read_lidar),
      at("target", "targets/*/target.yaml", "what the replica arm holds",
         [](const fs::path& file) { read_target_folder(file.parent_path(), 0); }),
      at("devices", "config/devices.yaml", "addresses and timing of the boxes of hardware",
         [](const fs::path& file) { load_devices(file.parent_path()); }),
      at("plc", "config/registers/plc*.yaml", "registers of the facility's PLC",
         [](const fs::path& file) { PlcMap::load(file); }),
      at("registers", "config/registers/*.yaml", "registers of an arm's controller",
         [](const fs::path& file) { RegisterMap::load(file); }),
      at("simulation", "config/simulation.yaml", "the simulated cell",
         [](const fs::path& file) { load_simulation(file); }),
      at("simulation_lidar", "config/simulation_lidar.yaml", "the simulated LIDAR",
         [](const fs::path& file) { load_simulated_lidar(file); }),
      at("world", "config/worlds/*.yaml", "how a simulated world departs from the files",
         [](const fs::path& file) {
           load_world(file.parent_path().parent_path(), file.stem().string());
         }),
      at("calibration", "config/calibration.yaml", "how well the cell is known, unmeasured",
         [](const fs::path& file) { testbed::load_calibration_settings(file); }),
      at("tracker", "config/tracker.yaml", "reflectors of a laser tracker",
         [](const fs::path& file) { load_tracker_setup(file); }),
      at("console", "config/console.yaml", "the operator's web page",
         [](const fs::path& file) { console::load_console_config(file.parent_path()); }),
      at("twin", "config/twin.yaml", "how long nodes compute, in the twin",
         [](const fs::path& file) { compute_delays(file.parent_path()); }),
      at("night", "procedures/nights/*.yaml", "what runs every night, and how it is judged",
         [](const fs::path& file) { nights::load_plan(file); }),
      at("campaign", "procedures/campaigns/*.yaml", "trials over a grid of parameters",
         [](const fs::path& file) { campaigns::load_manifest(file); }),
      at("slurm", "procedures/campaigns/slurm/*.yaml", "a cluster's settings for campaigns",
         [](const fs::path& file) { campaigns::load_slurm_options(file); }),
  };
  return all;
}

std::vector<fs::path> shipped_files(const ConfigKind& kind) {
  glob_t found{};
  std::vector<fs::path> files;
  if (glob((shared_files() / kind.files).c_str(), 0, nullptr, &found) == 0) {
    for (std::size_t i = 0; i < found.gl_pathc; ++i) {
      const fs::path file = found.gl_pathv[i];
      if (&kind_of_file(file) == &kind) files.push_back(file);
    }
  }
  globfree(&found);
  return files;
}

const ConfigKind& config_kind(const std::string& name) {
  std::vector<std::string> names;
  for (const ConfigKind& kind : config_kinds()) {
    if (kind.name == name) return kind;
    names.push_back(kind.name);
  }
  throw InputError("found '" + name + "', expected a file or one of: " + joined(names));
}

const ConfigKind& kind_of_file(const fs::path& file) {
  const fs::path path = fs::absolute(file).lexically_normal();
  for (const ConfigKind& kind : config_kinds()) {
    // Of a configuration anywhere: what is below `config` or `targets` counts.
    const fs::path files = kind.files;
    fs::path tail;
    auto part = path.end();
    for (auto count = std::distance(files.begin(), files.end()); count > 1; --count) {
      tail = tail.empty() ? *--part : *--part / tail;
    }
    const fs::path below = files.lexically_relative(*files.begin());
    if (fnmatch(below.c_str(), tail.c_str(), FNM_PATHNAME) == 0) return kind;
  }
  throw InputError(file.string() +
                   ": is no file of a configuration by name and folder; 'berth "
                   "config describe' lists the kinds");
}

}  // namespace berth
