// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/profile.h"

#include "common/core/config.h"
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
    // reported below, with the expected unit
  }
  throw config.error(key, "found '" + text + "', expected a force above 0 such as '20 N'");
}

Profile::Orbit read_orbit(Config config) {
  Profile::Orbit orbit;
  orbit.mean_motion = mean_motion(config.quantity("altitude", Dimension::length, above(0)));
  orbit.bar = config.choice<Profile::Bar>(
      "boresight_along", {{"v_bar", Profile::Bar::v_bar}, {"r_bar", Profile::Bar::r_bar}});
  orbit.length_scale = config.number("length_scale", above(0));
  orbit.time_scale = config.number("time_scale", above(0));
  config.finish();
  return orbit;
}

Profile::Vehicle read_vehicle(Config config) {
  Profile::Vehicle vehicle;
  vehicle.mass = config.quantity("mass", Dimension::mass, above(0));
  vehicle.thrust = newtons(config, "thrust");
  config.optional("shortest_burn", Dimension::time, vehicle.shortest_burn, at_least(0));
  vehicle.specific_impulse = config.quantity("specific_impulse", Dimension::time, above(0));
  config.finish();
  return vehicle;
}

Profile::Corridor read_corridor(Config config) {
  Profile::Corridor corridor;
  corridor.radius = config.quantity("radius", Dimension::length, above(0));
  corridor.half_angle = config.quantity("half_angle", Dimension::angle, within(0, 0.8));
  config.finish();
  return corridor;
}

std::vector<Profile::HoldPoint> read_hold_points(Config& config) {
  std::vector<Profile::HoldPoint> points;
  for (Config& section : config.sections("hold_points")) {
    Profile::HoldPoint point;
    point.range = section.quantity("range", Dimension::length, above(0));
    point.dwell = section.quantity("dwell", Dimension::time, at_least(0));
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
  go_on.offset = config.quantity("offset", Dimension::length, above(0));
  go_on.angle = config.quantity("angle", Dimension::angle, above(0));
  go_on.patience = config.quantity("patience", Dimension::time, above(0));
  config.finish();
  return go_on;
}

Profile::Final read_final(Config config) {
  Profile::Final final;
  final.range = config.quantity("range", Dimension::length, above(0));
  final.speed = config.quantity("contact_speed", Dimension::speed, above(0));
  config.finish();
  return final;
}

Profile::Abort read_abort(Config config) {
  Profile::Abort abort;
  abort.after = config.quantity("after", Dimension::time, above(0));
  abort.retreat_range = config.quantity("retreat_range", Dimension::length, above(0));
  abort.retreat_speed = config.quantity("retreat_speed", Dimension::speed, above(0));
  abort.retreat_time = config.quantity("retreat_time", Dimension::time, above(0));
  config.finish();
  return abort;
}

Profile::Tracking read_tracking(Config config) {
  Profile::Tracking tracking;
  tracking.response = config.quantity("response", Dimension::time, above(0));
  tracking.speed = config.quantity("speed", Dimension::speed, above(0));
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
  profile.law = config.choice<Profile::Law>(
      "law", {{"kinematic", Profile::Law::kinematic},
              {"clohessy_wiltshire", Profile::Law::clohessy_wiltshire}});
  if (profile.law == Profile::Law::clohessy_wiltshire) {
    profile.orbit = read_orbit(config.section("orbit"));
    profile.vehicle = read_vehicle(config.section("vehicle"));
  }
  profile.align =
      config.choice<Profile::Align>("align", {{"docking_axis", Profile::Align::docking_axis},
                                              {"line_of_sight", Profile::Align::line_of_sight}});
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
