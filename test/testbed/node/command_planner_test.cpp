// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/node/command_planner.h"

#include <cstdio>

#include "common/core/random.h"
#include "lcmtypes/conversions.h"
#include "test/catch.h"
#include "test/testbed/motion/bench.h"

namespace berth::testbed {
namespace {

PathLimits with_speed(PathLimits limits, double joint_speed) {
  limits.rates.speed = joint_speed;
  return limits;
}

struct Commands : Bench {
  /// joint_speed: part of the joints' own that a path may use.
  explicit Commands(double joint_speed)
      : limited(cell, with_speed(settings.path, joint_speed), clearance) {}

  RayCaster surface{cell.target.mesh};
  Guidance guidance{surface, settings.guidance};
  PathCheck limited;
  MotionPlanner limited_planner{cell, limited, clearance};
  CommandPlanner commands{cell, settings, limited_planner, surface};

  /// Empty: it may start.
  std::string refusal(const testbed_command2_t& command) {
    const auto result = commands.plan(command, home, 0, guidance);
    const auto* text = std::get_if<std::string>(&result);
    return text == nullptr ? "" : *text;
  }
};

testbed_command2_t move_to(const Pose& goal, double speed, double angular_speed) {
  testbed_command2_t command{};
  command.command = testbed_command2_t::MOVE;
  set_pose(goal, command);
  command.speed_m_s = speed;
  command.angular_speed_rad_s = angular_speed;
  return command;
}

TEST_CASE("a move that is only too fast passes at the speed that its refusal names") {
  Commands bench(0.01);
  Random random(21, "too fast");
  int refused = 0;
  for (int n = 0; n < 12; ++n) {
    Pose goal = bench.home_pose();
    goal.position +=
        Vector3d(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), random.uniform(-1.5, -0.5));
    goal.rotation = rotation_from_vector(random.normal_vector(0.2)) * goal.rotation;
    const std::string refusal = bench.refusal(move_to(goal, 0.5, 0.5));
    if (refusal.empty()) continue;
    INFO(refusal);
    double percent = 0;
    double speed = 0;
    double turn = 0;
    const auto at = refusal.find("it passes at");
    if (at == std::string::npos) continue;
    REQUIRE(std::sscanf(refusal.c_str() + at,
                        "it passes at %lf %% of the requested speed, %lf mm/s "
                        "and %lf deg/s",
                        &percent, &speed, &turn) == 3);
    CHECK(bench.refusal(move_to(goal, 1e-3 * speed, radians(turn))).empty());
    CHECK_FALSE(bench.refusal(move_to(goal, 1.5e-3 * speed, radians(1.5 * turn))).empty());
    ++refused;
  }
  CHECK(refused > 3);
}

TEST_CASE("a trajectory that is only too fast passes when it lasts as much longer as reported") {
  Commands bench(0.8);
  testbed_command2_t command{};
  command.command = testbed_command2_t::TRAJECTORY;
  const auto waypoints = [&](double stretch) {
    command.waypoints.clear();
    for (int i = 0; i <= 40; ++i) {
      const double x = i / 40.0;
      waypoint_t waypoint{};
      Pose pose = bench.home_pose();
      pose.position.x() += 0.3 * x * x * (3 - 2 * x);
      set_pose(pose, waypoint);
      waypoint.time_s = 0.3 * x * stretch;
      command.waypoints.push_back(waypoint);
    }
  };
  waypoints(1);
  const std::string refusal = bench.refusal(command);
  double percent = 0;
  double times = 0;
  const auto at = refusal.find("it passes at");
  INFO(refusal);
  REQUIRE(at != std::string::npos);
  REQUIRE(std::sscanf(refusal.c_str() + at,
                      "it passes at %lf %% of the requested speed, all its times %lf times",
                      &percent, &times) == 2);
  CHECK(times == Approx(100 / percent).epsilon(2e-3));
  waypoints(times);
  CHECK(bench.refusal(command).empty());
}

}  // namespace
}  // namespace berth::testbed
