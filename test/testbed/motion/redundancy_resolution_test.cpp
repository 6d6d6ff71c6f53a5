// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <functional>

#include "common/core/random.h"
#include "test/catch.h"
#include "test/testbed/motion/bench.h"

namespace berth::testbed {
namespace {

/// Where two arms may be commanded to bring the replica: in front of the sensor, turned by up to
/// `turn`.
Pose random_goal(const Bench& bench, double turn, Random& random) {
  Pose goal = bench.home_pose();
  goal.position +=
      Vector3d(random.uniform(-0.8, 0.8), random.uniform(-0.6, 0.6), random.uniform(-2.5, 0.3));
  goal.rotation =
      rotation_from_vector(random.uniform(0, turn) * random.normal_vector(1).normalized()) *
      goal.rotation;
  return goal;
}

double milliseconds_of(const std::function<void()>& work) {
  const std::clock_t begin = std::clock();
  work();
  return 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
}

double quantile(std::vector<double> list, double q) {
  if (list.empty()) return 0;
  std::sort(list.begin(), list.end());
  return list[static_cast<std::size_t>(q * static_cast<double>(list.size() - 1))];
}

struct Figures {
  int planned = 0;
  std::vector<double> joint, manipulability, speed, milliseconds;

  void add(const Bench& bench, const Pose& goal, const MotionPlanner::Plan& plan) {
    ++planned;
    const Ease ease = bench.ease(*plan.motion);
    joint.push_back(degrees(ease.joint));
    manipulability.push_back(ease.manipulability);
    speed.push_back(1e3 * bench.max_speed(goal, plan.resolution));
  }
  void print(const char* how, double turn, int paths) const {
    std::printf(
        "| %-7s | %2.0f | %2d of %d | %.1f (%.1f) | %.3f (%.3f) | %.0f (%.0f) | %.1f (%.1f) |\n",
        how, turn, planned, paths, quantile(joint, 0.5), quantile(joint, 0),
        quantile(manipulability, 0.5), quantile(manipulability, 0), quantile(speed, 0.5),
        quantile(speed, 0), quantile(milliseconds, 0.5), quantile(milliseconds, 1));
  }
};

TEST_CASE("what resolution gains over the nominal share", "[.benchmark]") {
  std::printf(
      "| resolution | turn <= deg | planned | least joint margin deg | manipulability | largest "
      "passing speed mm/s | planning ms |\n");
  const Bench bench;
  for (const double turn : {15.0, 45.0, 75.0}) {
    Random random(11, "resolution");
    Figures nominal;
    Figures searched;
    constexpr int paths = 60;
    for (int n = 0; n < paths; ++n) {
      const Pose goal = random_goal(bench, radians(turn), random);
      const auto path =
          std::make_shared<StraightPath>(bench.home_pose(), goal, bench.settings.motion);
      RedundancyResolution resolution;
      resolution.travel = bench.cell.sensor_share;
      const auto motion = std::make_shared<RelativeMotion>(
          path, ArmAllocation(bench.cell, resolution, FrozenArm::none, bench.home));
      bool passes = false;
      nominal.milliseconds.push_back(
          milliseconds_of([&] { passes = !bench.check.check(*motion, bench.home); }));
      if (passes) nominal.add(bench, goal, {motion, resolution});
      std::optional<MotionPlanner::Result> result;
      searched.milliseconds.push_back(
          milliseconds_of([&] { result = bench.planner.plan(path, bench.home, FrozenArm::none); }));
      if (const auto* plan = std::get_if<MotionPlanner::Plan>(&*result)) {
        searched.add(bench, goal, *plan);
      }
    }
    nominal.print("nominal", turn, paths);
    searched.print("search", turn, paths);
  }
}

}  // namespace
}  // namespace berth::testbed
