// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/lidar_profile.h"

#include "common/core/config.h"

namespace berth {

LidarProfile load_lidar_profile(const std::filesystem::path& path) {
  Config config = Config::load(path);
  LidarProfile profile;
  profile.model = config.text("model");
  const auto field = config.quantities("field_of_view", Dimension::angle, above(0).below(3.1));
  if (field.size() != 2) throw config.error("field_of_view", "expected [width, height]");
  profile.field_of_view_width = field[0];
  profile.field_of_view_height = field[1];
  profile.rate_hz = config.quantity("rate", Dimension::frequency, within(1, 1e6));
  profile.minimum_step_rad = config.quantity("minimum_step", Dimension::angle, above(0));
  profile.beams_max = config.small_integer("beams_max", at_least(1));
  profile.beam = read_beam_model(config.section("beam"));
  Config receiver = config.optional_section("receiver");  // the rest of it is for the simulator
  receiver.optional("pulse_length", Dimension::length, profile.beam.pulse_length_m, above(0));
  receiver.optional("min_echo", profile.beam.min_echo, within(0, 1));
  config.finish();
  return profile;
}

LidarProfile load_lidar_profile(const RunSetup& run, const std::string& otherwise) {
  std::string name = otherwise;
  Config::load(run.layout_file()).optional("lidar", name);
  return load_lidar_profile(run.config / "lidars" / (name + ".yaml"));
}

}  // namespace berth
