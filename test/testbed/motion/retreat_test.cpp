// SPDX-License-Identifier: BSD-3-Clause
// A retreat goes back along where the arms came from: how far from it, over many trajectories.
#include "common/core/random.h"
#include "test/catch.h"
#include "test/testbed/motion/bench.h"
#include "testbed/motion/trajectory_history.h"
#include "testbed/trajectories/trajectory.h"

namespace berth::testbed {
namespace {

constexpr double period = 1.0 / 60;

struct Deviation {
  double position = 0;  // m
  double angle = 0;     // rad
  double joint = 0;     // rad
};

/// Of a pair of arms from the polyline of where they went, joints and relative pose alike.
Deviation from_way(const Cell& cell, const std::vector<ArmPair>& way, const ArmPair& arms) {
  std::size_t nearest = 0;
  for (std::size_t i = 0; i < way.size(); ++i) {
    if (max_change(way[i], arms) < max_change(way[nearest], arms)) nearest = i;
  }
  const std::size_t first = nearest == 0 ? 0 : nearest - 1;
  const std::size_t last = std::min(nearest + 1, way.size() - 1);
  Deviation nearest_deviation{1, 1, 1};
  for (std::size_t i = first; i < last; ++i) {
    for (int k = 0; k <= 50; ++k) {
      const ArmPair there = blend(way[i], way[i + 1], k / 50.0);
      const double joint = max_change(there, arms);
      if (joint >= nearest_deviation.joint) continue;
      const Pose pose = cell.relative_pose(arms.replica, arms.sensor);
      const Pose flown = cell.relative_pose(there.replica, there.sensor);
      nearest_deviation = {distance(pose, flown), angle_between(pose, flown), joint};
    }
  }
  return nearest_deviation;
}

Waypoints random_trajectory(Random& random, int kind, const Pose& from) {
  switch (kind % 4) {
    case 0: {
      Straight options;
      options.by = {Vector3d(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2),
                             random.uniform(-0.8, -0.3)),
                    rotation_from_vector(random.normal_vector(0.15))};
      return straight(from, options);
    }
    case 1: {
      Spiral options;
      options.radius = random.uniform(0.05, 0.2);
      return spiral(from, options);
    }
    case 2: {
      FlyAround options;
      options.axis = random.normal_vector(1).normalized();
      options.angle = radians(random.uniform(10, 25));
      return fly_around(from, options);
    }
    default: {
      BarApproach options;
      options.to = from.position.z() - random.uniform(0.4, 0.8);
      options.holds = {0.5 * (options.to + from.position.z())};
      options.hold_for = 2;
      options.bulge = 0.05;
      return bar_approach(from, options);
    }
  }
}

TEST_CASE("a retreat keeps to the trajectory that was flown, to its beginning") {
  const Bench bench;
  Random random(17, "retreat");
  Deviation worst;
  int flown = 0;
  for (int n = 0; n < 12; ++n) {
    const auto path =
        std::make_shared<WaypointPath>(random_trajectory(random, n, bench.home_pose()));
    const auto planned = bench.planner.plan(path, bench.home, FrozenArm::none);
    const auto* plan = std::get_if<MotionPlanner::Plan>(&planned);
    if (plan == nullptr) continue;  // the arms cannot: nothing to come back from
    ++flown;
    TrajectoryHistory history(bench.cell);
    history.begin(bench.home);
    std::vector<ArmPair> way{bench.home};
    const double until = random.uniform(0.3, 1) * path->duration();
    for (double t = period; t < until; t += period) {
      way.push_back(plan->motion->at(t, way.back(), nullptr).value());
      history.add(way.back());
    }
    const auto back = history.way_back(way.back(), bench.settings.motion);
    const auto refused = bench.check.check(*back, way.back());
    CHECK((refused ? refused->text : "") == "");
    ArmPair arms = way.back();
    CHECK(max_change(back->at(0, arms, nullptr).value(), arms) < 1e-9);
    for (double t = 0; t < back->duration(); t += 0.1) {
      arms = back->at(t, arms, nullptr).value();
      const Deviation deviation = from_way(bench.cell, way, arms);
      worst.position = std::max(worst.position, deviation.position);
      worst.angle = std::max(worst.angle, deviation.angle);
      worst.joint = std::max(worst.joint, deviation.joint);
    }
    CHECK(max_change(back->at(back->duration(), arms, nullptr).value(), bench.home) < 1e-9);
  }
  CHECK(flown >= 8);
  CHECK(worst.position < 0.5e-3);
  CHECK(degrees(worst.angle) < 0.02);
  CHECK(degrees(worst.joint) < 0.02);
  WARN(flown << " trajectories flown back: at most " << 1e6 * worst.position << " um, "
             << degrees(worst.angle) << " deg, joints " << degrees(worst.joint)
             << " deg from the trail");
}

}  // namespace
}  // namespace berth::testbed
