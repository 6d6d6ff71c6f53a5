// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/operator_words.h"

#include "common/core/config.h"
#include "procedures/language/verbs.h"

namespace berth::procedures {

double speed_override_of(const std::string& text) {
  constexpr double slowest = 0.01;
  const double override = parse_quantity(text, Dimension::number);
  if (override >= slowest && override <= 1) return override;
  throw InputError("found '" + text + "', expected 1 % to 100 %; to stop, hold it");
}

facility_command_t lamps_of(const std::string& text, const facility_state_t& now) {
  Config config = Config::parse("{" + text + "}", "lamps");
  if (config.keys().empty()) {
    throw InputError("found '" + text + "', expected lamps such as 'sun: 80 %, albedo: 10 %'");
  }
  const Lights lights = read_lamps(
      config, {now.sun_lamp, now.albedo_lamp, now.sun_azimuth_rad, now.sun_elevation_rad});
  config.finish();
  facility_command_t command{};
  command.sun_lamp = lights.sun;
  command.albedo_lamp = lights.albedo;
  command.sun_azimuth_rad = lights.sun_azimuth;
  command.sun_elevation_rad = lights.sun_elevation;
  return command;
}

}  // namespace berth::procedures
