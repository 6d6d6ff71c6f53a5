// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/world.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/core/random.h"
#include "common/core/text.h"

namespace berth {
namespace {

/// [x, y, z, w, p, r] in mm and degrees.
std::string listed(const Pose& pose) {
  std::string text;
  for (const double value : xyzwpr_from_pose(pose)) {
    text += (text.empty() ? "[" : ", ") + fixed(value, 5);
  }
  return text + "]";
}

std::string in_mm(double metres) { return fixed(1e3 * metres, 3) + " mm"; }

std::string names_of_worlds(const std::filesystem::path& directory) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(directory, error)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem());
  }
  std::sort(names.begin(), names.end());
  return joined(names);
}

std::string text_of(const TrueTarget& truth) {
  std::string text = "target:\n  parts:\n";
  for (const TrueTarget::Part& part : truth.parts) {
    text += "    - {name: '" + part.name + "', surface_sigma: " + in_mm(part.sigma) +
            ", correlation_length: " + in_mm(part.correlation_length) +
            ", surface_rms: " + in_mm(part.rms) + ", joint: " + fixed(degrees(part.angle), 4) +
            " deg}\n";
  }
  if (!truth.missing.empty()) text += "  missing: '" + truth.missing + "'\n";
  if (truth.extra_size != Vector3d::Zero()) {
    const Vector3d& size = truth.extra_size;
    text += "  extra: {pose: " + listed(truth.extra) + ", size: [" + in_mm(size.x()) + ", " +
            in_mm(size.y()) + ", " + in_mm(size.z()) + "]}\n";
  }
  return text;
}

void read_controllers(Config config, WorldSettings& world) {
  using Program = SimulatedRobot::Program;
  world.program =
      config.choice<Program>("program", {{"interpolating", Program::interpolating},
                                         {"position_register", Program::position_register}});
  config.optional("cnt", world.cnt, within(0, 100));
  config.finish();
}

}  // namespace

WorldSettings load_world(const std::filesystem::path& config, const std::string& name) {
  const std::filesystem::path directory = config / "worlds";
  const std::filesystem::path path = directory / (name + ".yaml");
  if (!std::filesystem::exists(path)) {
    throw InputError("world '" + name + "' is not there; expected one of " +
                     names_of_worlds(directory) + ", or a file " + path.string());
  }
  Config file = Config::load(path);
  WorldSettings world;
  read_geometry(file.optional_section("geometry"), world.cell);
  read_clocks(file.optional_section("clocks"), world.cell);
  world.target = read_target_departures(file.optional_section("target"));
  world.scanner = read_scanner_errors(file.optional_section("scanner"));
  if (file.has("controllers")) read_controllers(file.section("controllers"), world);
  file.finish();
  return world;
}

LidarErrors draw_lidar_errors(const WorldSettings& world, std::uint64_t seed) {
  Random random(seed, "perturbation of the lidar");
  LidarErrors errors;
  errors.clock = utime_from_seconds(random.normal(world.cell.lidar_clock));
  errors.scanner = world.scanner;
  errors.scanner.range_bias = random.normal(world.scanner.range_bias);
  return errors;
}

std::string text_of(const ArmErrors& replica, const ArmErrors& sensor, const TrueTarget& target,
                    const LidarErrors& lidar) {
  std::string text =
      "# SPDX-License-Identifier: BSD-3-Clause\n# By how much the simulated world departed from "
      "the cell's files.\n";
  for (const auto& [name, errors] : {std::pair{"replica", &replica}, {"sensor", &sensor}}) {
    text += std::string(name) + ":\n  base: " + listed(errors->base) +
            "\n  tool: " + listed(errors->tool) + "\n  zero: [";
    for (std::size_t i = 0; i < 6; ++i) {
      text += (i == 0 ? "" : ", ") + fixed(degrees(errors->zero[i]), 5) + " deg";
    }
    text += "]\n  links:\n";
    for (const Pose& link : errors->links) text += "    - " + listed(link) + "\n";
    text += "  clock: " + fixed(1e3 * seconds(errors->clock), 3) +
            " ms\n  report_lag: " + fixed(1e3 * seconds(errors->report_lag), 3) + " ms\n";
  }
  return text + text_of(target) + "lidar:\n  clock: " + fixed(1e3 * seconds(lidar.clock), 3) +
         " ms\n  range: " + in_mm(lidar.scanner.range_bias) + "\n";
}

}  // namespace berth
