// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/motion_steps.h"
#include "procedures/language/procedure.h"
#include "test/catch.h"
#include "test/procedures/language/parsed.h"

namespace berth::procedures {
namespace {

using Catch::Matchers::Contains;

testbed_command2_t command_of(const std::string& step) {
  const Pose here = pose_from_xyzwpr({10, 20, 4000, 1, 2, 3});
  const auto command = motion_command(parsed_step(step).steps[1].verb, here);
  REQUIRE(command);
  return *command;
}

TEST_CASE("an approach names its guidance, and what the target does meanwhile") {
  const auto command = command_of(
      "approach: {standoff: 3 m, speed: 20 mm/s, guidance: v_bar, target_motion: "
      "{tumble: {inertia: [1, 2, 2.5], rate: [1 deg/s, 0 deg/s, 2 deg/s], duration: 20 s}}}");
  CHECK(command.command == testbed_command2_t::APPROACH);
  CHECK(command.guidance == "v_bar");
  REQUIRE(command.waypoint_count > 100);
  CHECK(command.waypoints.size() == static_cast<std::size_t>(command.waypoint_count));
  // in the frame that the model has at the start, wherever that is
  CHECK(command.waypoints.front().q_wxyz[0] == Approx(1));
  for (const double p : command.waypoints.back().position_m) CHECK(p == 0);
  CHECK(std::abs(command.waypoints.back().q_wxyz[0]) < 0.99);

  const auto plain = command_of("approach: {standoff: 3 m, speed: 20 mm/s}");
  CHECK(plain.guidance == "");
  CHECK(plain.waypoint_count == 0);
}

TEST_CASE("a retreat goes at the speed given, or the testbed's own") {
  CHECK(command_of("retreat: {speed: 30 mm/s}").command == testbed_command2_t::RETREAT);
  CHECK(command_of("retreat: {speed: 30 mm/s}").speed_m_s == Approx(0.03));
  CHECK(command_of("retreat: {}").speed_m_s == 0);
  CHECK_THROWS_WITH(parsed_step("retreat: {speed: 0 mm/s}"), Contains("speed"));
}

TEST_CASE("a pose is kept for a time alone, or by a profile") {
  CHECK(command_of("station_keep: 5 s").guidance == "");
  const auto command = command_of(
      "station_keep: {for: 5 s, guidance: docking_axis, target_motion: {drift: {duration: 5 s}}}");
  CHECK(command.command == testbed_command2_t::STATION_KEEP);
  CHECK(command.guidance == "docking_axis");
  CHECK(command.waypoint_count > 0);
  CHECK(command.position_m[2] == Approx(4));
}

TEST_CASE("an outside GNC steers by its name, within speeds, until something is so") {
  const auto command = command_of(
      "guided: {by: gnc, for: 20 s, speed: 30 mm/s, turn: 1 deg/s, until: estimated_range < 4 m}");
  CHECK(command.command == testbed_command2_t::GUIDED);
  CHECK(command.guidance == "gnc");
  CHECK(command.speed_m_s == Approx(0.03));
  CHECK(command.angular_speed_rad_s == Approx(radians(1.0)));
  CHECK_THROWS_WITH(parsed_step("guided: {by: gnc, for: 20 s, speed: 30 mm/s, until: nonsense}"),
                    Contains("until"));
  CHECK_THROWS_WITH(
      parsed_step("approach: {standoff: 3 m, speed: 20 mm/s, target_motion: {swing: {}}}"),
      Contains("swing"));
}

}  // namespace
}  // namespace berth::procedures
