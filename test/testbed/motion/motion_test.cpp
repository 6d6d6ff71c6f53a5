// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/random.h"
#include "test/catch.h"
#include "testbed/motion/arm_allocation.h"
#include "testbed/motion/trajectory_history.h"

namespace berth::testbed {
namespace {

const Cell& range_cell() {
  static const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  return cell;
}

ArmPair home() { return {range_cell().replica.home, range_cell().sensor.home}; }

TEST_CASE("smooth travel keeps its limits and arrives, long or short") {
  Random random(1, "travel");
  for (int trial = 0; trial < 200; ++trial) {
    const double length = random.uniform(1e-4, 3);
    const double speed = random.uniform(0.005, 0.5);
    const double acceleration = random.uniform(0.01, 0.5);
    const double jerk = random.uniform(0.05, 2);
    const SmoothTravel travel(length, speed, acceleration, jerk);
    CHECK(travel.position(travel.duration()) == Approx(length));
    CHECK(travel.position(-1) == 0);
    const double dt = travel.duration() / 2000;
    double worst_speed = 0;
    double worst_acceleration = 0;
    double worst_jerk = 0;
    double last = 0;
    for (int i = 1; i < 2000; ++i) {
      const double t = i * dt;
      const double h = 1e-4 * travel.duration() / 2000;
      const double slope = (travel.position(t + h) - travel.position(t - h)) / (2 * h);
      CHECK(travel.speed(t) == Approx(slope).epsilon(1e-3).margin(1e-3 * speed));
      const double a = (travel.speed(t + dt / 2) - travel.speed(t - dt / 2)) / dt;
      worst_speed = std::max(worst_speed, travel.speed(t));
      worst_acceleration = std::max(worst_acceleration, std::abs(a));
      if (i > 1) worst_jerk = std::max(worst_jerk, std::abs(a - last) / dt);
      last = a;
    }
    CHECK(worst_speed <= speed * 1.0001);
    CHECK(worst_acceleration <= acceleration * 1.01);
    CHECK(worst_jerk <= jerk * 1.05);
  }
}

TEST_CASE("time stops and goes on smoothly, and never runs backwards") {
  TimeScale scale(0.8);
  scale.set_target(1);
  double rate = 0;
  double worst_change = 0;
  const auto run = [&](double seconds) {
    double passed = 0;
    for (int i = 0; i < static_cast<int>(seconds * 60); ++i) {
      const double step = scale.advance(1.0 / 60);
      CHECK(step >= 0);
      worst_change = std::max(worst_change, std::abs(scale.rate() - rate));
      rate = scale.rate();
      passed += step;
    }
    return passed;
  };
  run(0.3);
  scale.set_target(0);  // in the middle of the rise
  run(1.0);
  CHECK(scale.at_rest());
  CHECK(run(1.0) == 0);
  scale.set_target(0.5);
  run(1.0);
  CHECK(run(1.0) == Approx(0.5));
  scale.set_target(1);
  run(1.0);
  CHECK(scale.rate() == 1);
  scale.set_target(0);
  run(1.0);
  CHECK(scale.at_rest());
  CHECK(worst_change < 0.08);
}

TEST_CASE("a path of waypoints meets them with a velocity that is continuous") {
  std::vector<WaypointPath::Waypoint> waypoints{
      {0, pose_from_xyzwpr({0, 0, 5500, 0, 0, 0})},
      {4, pose_from_xyzwpr({200, 0, 5200, 20, 0, 10})},
      {6, pose_from_xyzwpr({100, 100, 5000, 30, 25, -40})},
      {11, pose_from_xyzwpr({0, 0, 4800, -20, 80, 10})},
  };
  const WaypointPath path(waypoints);
  for (const auto& waypoint : waypoints) {
    CHECK(distance(path.at(waypoint.time).pose, waypoint.pose) < 1e-9);
    CHECK(angle_between(path.at(waypoint.time).pose, waypoint.pose) < 1e-9);
  }
  const double h = 1e-4;
  const auto velocity = [&](double t) {
    return velocity_between(path.at(t - h).pose, path.at(t + h).pose, 2 * h);
  };
  for (std::size_t i = 1; i < 3; ++i) {
    const Velocity before = velocity(waypoints[i].time - 2 * h);
    const Velocity after = velocity(waypoints[i].time + 2 * h);
    CHECK((before.linear - after.linear).norm() < 2e-3);
    CHECK((before.angular - after.angular).norm() < 5e-3);
  }
  CHECK(velocity(2 * h).linear.norm() < 1e-3);
  CHECK(velocity(11 - 2 * h).angular.norm() < 5e-3);
}

TEST_CASE("two arms deliver the relative pose, smoothly, from the joints where they are") {
  const Pose from = range_cell().relative_pose(home().replica, home().sensor);
  const Pose to = pose_from_xyzwpr({150, -100, 3800, 12, -10, 15});
  const auto path = std::make_shared<StraightPath>(from, to, RelativeLimits{});
  for (const FrozenArm frozen : {FrozenArm::none, FrozenArm::replica, FrozenArm::sensor}) {
    // one arm alone does not reach so far
    const double until = frozen == FrozenArm::none ? 1.0 : 0.15;
    const ArmAllocation allocation(range_cell(), RedundancyResolution{}, frozen, home());
    const RelativeMotion motion(path, allocation);
    ArmPair near = home();
    CHECK(max_change(*motion.at(0, near, nullptr), home()) < 1e-9);
    for (int i = 0; i <= 1000; ++i) {
      const double t = until * motion.duration() * i / 1000;
      std::string reason;
      const auto joints = motion.at(t, near, &reason);
      INFO(reason);
      REQUIRE(joints);
      const Pose reached = range_cell().relative_pose(joints->replica, joints->sensor);
      CHECK(distance(reached, path->at(t).pose) < 1e-9);
      CHECK(angle_between(reached, path->at(t).pose) < 1e-9);
      CHECK(max_change(near, *joints) < 0.02);
      near = *joints;
    }
    if (frozen == FrozenArm::replica) CHECK(near.replica == home().replica);
    if (frozen == FrozenArm::sensor) CHECK(near.sensor == home().sensor);
  }
}

TEST_CASE("the way back is the way there") {
  std::vector<ArmPair> points{home()};
  for (int i = 1; i < 5; ++i) {
    ArmPair next = points.back();
    next.replica[0] += 0.1;
    next.sensor[4] -= 0.05;
    points.push_back(next);
  }
  const RecordedMotion motion(points, {0.1, 0.2, 0.1, 0.3}, 0.1, 0.1, 0.4);
  CHECK(max_change(*motion.at(0, {}, nullptr), points.front()) < 1e-12);
  CHECK(max_change(*motion.at(motion.duration(), {}, nullptr), points.back()) < 1e-12);
  const ArmPair middle = *motion.at(motion.duration() / 2, {}, nullptr);
  CHECK(middle.replica[0] > points[1].replica[0]);
  CHECK(middle.replica[0] < points[4].replica[0]);
}

}  // namespace
}  // namespace berth::testbed
