// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/profile.h"

#include "common/core/positive.h"
#include "testbed/guidance/clohessy_wiltshire.h"

namespace berth::testbed {
namespace {

using Profile = GuidanceProfile;

/// Text such as "20 N".
double newtons(Config& config, const std::string& key) {
  const std::string text = config.text(key);
  const std::size_t unit = text.find_last_not_of(" N") + 1;
  try {
    if (unit < text.size() && text.back() == 'N') {
      const double value = parse_quantity(text.substr(0, unit), Dimension::number);
      if (value > 0) return value;
    }
  } catch (const InputError&) {
    // told below, with the unit that is meant
  }
  throw config.error(key, "found '" + text + "', expected a force above 0 such as '20 N'");
}

Profile::Orbit read_orbit(Config config) {
  Profile::Orbit orbit;
  orbit.mean_motion = mean_motion(positive(config, "altitude", Dimension::length));
  orbit.bar = config.choice("boresight_along", {"v_bar", "r_bar"}) == "v_bar" ? Profile::Bar::v_bar
                                                                              : Profile::Bar::r_bar;
  orbit.length_scale = positive(config, "length_scale", Dimension::number);
  orbit.time_scale = positive(config, "time_scale", Dimension::number);
  config.finish();
  return orbit;
}

Profile::Vehicle read_vehicle(Config config) {
  Profile::Vehicle vehicle;
  vehicle.mass = positive(config, "mass", Dimension::mass);
  vehicle.thrust = newtons(config, "thrust");
  config.optional("shortest_burn", Dimension::time, vehicle.shortest_burn);
  expect_not_negative(config, "shortest_burn", vehicle.shortest_burn);
  vehicle.specific_impulse = positive(config, "specific_impulse", Dimension::time);
  config.finish();
  return vehicle;
}

Profile::Corridor read_corridor(Config config) {
  Profile::Corridor corridor;
  corridor.radius = positive(config, "radius", Dimension::length);
  corridor.half_angle = config.quantity("half_angle", Dimension::angle);
  if (corridor.half_angle < 0 || corridor.half_angle > 0.8) {
    throw config.error("half_angle", "expected 0 deg to 45 deg");
  }
  config.finish();
  return corridor;
}

std::vector<Profile::HoldPoint> read_hold_points(Config& config) {
  std::vector<Profile::HoldPoint> points;
  for (Config& section : config.sections("hold_points")) {
    Profile::HoldPoint point;
    point.range = positive(section, "range", Dimension::length);
    point.dwell = section.quantity("dwell", Dimension::time);
    expect_not_negative(section, "dwell", point.dwell);
    if (!points.empty() && point.range >= points.back().range) {
      throw section.error("range", "must be nearer than the hold point before");
    }
    section.finish();
    points.push_back(point);
  }
  return points;
}

Profile::GoOn read_go_on(Config config) {
  Profile::GoOn go_on;
  go_on.offset = positive(config, "offset", Dimension::length);
  go_on.angle = positive(config, "angle", Dimension::angle);
  go_on.patience = positive(config, "patience", Dimension::time);
  config.finish();
  return go_on;
}

Profile::Final read_final(Config config) {
  Profile::Final final;
  final.range = positive(config, "range", Dimension::length);
  final.speed = positive(config, "contact_speed", Dimension::speed);
  config.finish();
  return final;
}

Profile::Abort read_abort(Config config) {
  Profile::Abort abort;
  abort.after = positive(config, "after", Dimension::time);
  abort.retreat_range = positive(config, "retreat_range", Dimension::length);
  abort.retreat_speed = positive(config, "retreat_speed", Dimension::speed);
  abort.retreat_time = positive(config, "retreat_time", Dimension::time);
  config.finish();
  return abort;
}

Profile::Tracking read_tracking(Config config) {
  Profile::Tracking tracking;
  tracking.response = positive(config, "response", Dimension::time);
  tracking.speed = positive(config, "speed", Dimension::speed);
  config.finish();
  return tracking;
}

}  // namespace

const char* name_of(Profile::Law law) {
  return law == Profile::Law::kinematic ? "kinematic" : "clohessy_wiltshire";
}

GuidanceProfile load_guidance_profile(const std::filesystem::path& file) {
  Config config = Config::load(file);
  Profile profile;
  profile.name = file.stem().string();
  const std::string law = config.choice("law", {"kinematic", "clohessy_wiltshire"});
  if (law == "clohessy_wiltshire") {
    profile.law = Profile::Law::clohessy_wiltshire;
    profile.orbit = read_orbit(config.section("orbit"));
    profile.vehicle = read_vehicle(config.section("vehicle"));
  }
  profile.align = config.choice("align", {"docking_axis", "line_of_sight"}) == "docking_axis"
                      ? Profile::Align::docking_axis
                      : Profile::Align::line_of_sight;
  profile.corridor = read_corridor(config.section("corridor"));
  profile.hold_points = read_hold_points(config);
  profile.go_on = read_go_on(config.section("go_on"));
  profile.final = read_final(config.section("final"));
  profile.abort = read_abort(config.section("abort"));
  profile.tracking = read_tracking(config.section("tracking"));
  config.finish();
  return profile;
}

}  // namespace berth::testbed
