// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/lidar_profile.h"

namespace berth {

LidarProfile load_lidar_profile(const std::filesystem::path& path) {
  Config config = Config::load(path);
  LidarProfile profile;
  profile.model = config.text("model");
  const auto field = config.quantities("field_of_view", Dimension::angle);
  if (field.size() != 2 || !(field[0] > 0 && field[0] < 3.1 && field[1] > 0 && field[1] < 3.1)) {
    throw config.error("field_of_view", "expected [width, height], each between 0 and 177 deg");
  }
  profile.field_of_view_width = field[0];
  profile.field_of_view_height = field[1];
  profile.rate_hz = config.quantity("rate", Dimension::frequency);
  if (!(profile.rate_hz >= 1 && profile.rate_hz <= 1e6)) {
    throw config.error("rate", "expected 1 Hz to 1000 kHz");
  }
  profile.minimum_step_rad = config.quantity("minimum_step", Dimension::angle);
  if (!(profile.minimum_step_rad > 0)) throw config.error("minimum_step", "expected more than 0");
  profile.beams_max = config.small_integer("beams_max");
  if (profile.beams_max < 1) throw config.error("beams_max", "expected at least 1");
  profile.beam = read_beam_model(config.section("beam"));
  if (config.has("receiver")) {  // the rest of it is for the simulator
    Config receiver = config.section("receiver");
    receiver.optional("pulse_length", Dimension::length, profile.beam.pulse_length_m);
    if (!(profile.beam.pulse_length_m > 0)) {
      throw receiver.error("pulse_length", "expected more than 0");
    }
    receiver.optional("min_echo", profile.beam.min_echo);
    if (!(profile.beam.min_echo >= 0 && profile.beam.min_echo <= 1)) {
      throw receiver.error("min_echo", "expected 0 % to 100 %");
    }
  }
  config.finish();
  return profile;
}

LidarProfile load_lidar_profile(const RunSetup& run, const std::string& otherwise) {
  std::string name = otherwise;
  Config::load(run.layout_file()).optional("lidar", name);
  return load_lidar_profile(run.config / "lidars" / (name + ".yaml"));
}

}  // namespace berth
