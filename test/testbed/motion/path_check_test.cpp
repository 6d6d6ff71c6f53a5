// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/path_check.h"

#include "common/core/random.h"
#include "test/catch.h"
#include "test/testbed/motion/bench.h"
#include "testbed/motion/clearance.h"

namespace berth::testbed {
namespace {

using Catch::Matchers::Contains;

/// A motion straight through joint space.
class JointLine final : public ArmMotion {
 public:
  JointLine(const ArmPair& a, const ArmPair& b, double duration)
      : a_(a), b_(b), duration_(duration) {}
  double duration() const override { return duration_; }
  std::optional<ArmPair> at(double t, const ArmPair&, std::string*) const override {
    const double x = t / duration_;
    return blend(a_, b_, x * x * (3 - 2 * x));
  }

 private:
  ArmPair a_;
  ArmPair b_;
  double duration_;
};

TEST_CASE(
    "the paper's approach passes: from 5.5 m with a modest attitude to 3.2 m from the surface") {
  Bench bench;
  const Pose home = bench.cell.relative_pose(bench.home.replica, bench.home.sensor);
  const Pose start = pose_from_xyzwpr({100, -100, 5500, 10, 8, -12});
  RelativeLimits limits = bench.settings.motion;
  const auto there = bench.planner.plan(std::make_shared<StraightPath>(home, start, limits),
                                        bench.home, FrozenArm::none);
  const auto* plan = std::get_if<MotionPlanner::Plan>(&there);
  REQUIRE(plan);
  ArmPair near = bench.home;
  for (int i = 0; i <= 100; ++i) {
    near = *plan->motion->at(plan->motion->duration() * i / 100, near, nullptr);
  }
  limits.speed = 0.02;
  Pose end = start;
  end.position.z() = 3.2;
  const auto approach =
      bench.planner.plan(std::make_shared<StraightPath>(start, end, limits), near, FrozenArm::none);
  const auto* refusal = std::get_if<Refusal>(&approach);
  INFO((refusal ? refusal->text : ""));
  CHECK_FALSE(refusal);
}

TEST_CASE("each limit refuses by its name, with the time at which it is broken") {
  Bench bench;
  ArmPair goal = bench.home;
  SECTION("a joint") {
    goal.replica[4] = radians(-140.0);
    const auto refusal = bench.check.check(JointLine(bench.home, goal, 20), bench.home);
    REQUIRE(refusal);
    CHECK_THAT(refusal->text, Contains("the replica arm: J5") && Contains("-125.00 deg"));
    CHECK(refusal->time > 5);
    CHECK(refusal->time < 20);
    CHECK(refusal->passing_rate == 0);
  }
  SECTION("the coupling of J2 and J3") {
    goal.sensor[2] = radians(-88.0);
    const auto refusal = bench.check.check(JointLine(bench.home, goal, 20), bench.home);
    REQUIRE(refusal);
    CHECK_THAT(refusal->text, Contains("the sensor arm: J2 + J3"));
  }
  SECTION("a singularity") {
    goal.replica[4] = radians(1.0);
    goal.replica[0] = radians(-90.0);
    const auto refusal = bench.check.check(JointLine(bench.home, goal, 20), bench.home);
    REQUIRE(refusal);
    CHECK_THAT(refusal->text, Contains("singularity") || Contains("comes within"));
  }
  SECTION("the floor") {
    goal.sensor[1] = radians(100.0);
    goal.sensor[2] = radians(-40.0);
    const auto refusal = bench.check.check(JointLine(bench.home, goal, 20), bench.home);
    REQUIRE(refusal);
    CHECK_THAT(refusal->text, Contains("comes within") && Contains("limit"));
  }
}

TEST_CASE("too fast a motion passes at the speed that the refusal names") {
  Bench bench;
  ArmPair goal = bench.home;
  goal.replica[5] += radians(60.0);
  const double duration = 0.25;
  const auto refusal = bench.check.check(JointLine(bench.home, goal, duration), bench.home);
  REQUIRE(refusal);
  CHECK_THAT(refusal->text, Contains("replica arm's J6 would need"));
  REQUIRE(refusal->passing_rate > 0);
  REQUIRE(refusal->passing_rate < 1);
  const double slower = duration / refusal->passing_rate;
  CHECK_FALSE(bench.check.check(JointLine(bench.home, goal, slower), bench.home));
}

TEST_CASE("J3 standing still does not hide that its motor turns with J2") {
  Bench bench;
  ArmPair goal = bench.home;
  goal.replica[1] += radians(15.0);
  goal.replica[2] += radians(15.0);  // the motor turns twice as far
  const auto refusal = bench.check.check(JointLine(bench.home, goal, 0.2), bench.home);
  REQUIRE(refusal);
  CHECK_THAT(refusal->text, Contains("motor of J3"));
}

TEST_CASE("clearance finds the nearest pair that all pairs would give") {
  Bench bench;
  Random random(3, "joints");
  for (int n = 0; n < 50; ++n) {
    ArmPair joints = bench.home;
    for (std::size_t i = 0; i < 6; ++i) {
      joints.replica[i] += random.uniform(-0.5, 0.5);
      joints.sensor[i] += random.uniform(-0.5, 0.5);
    }
    const Clearance::Result close = bench.clearance.worst(joints, 0.3);
    const Clearance::Result all = bench.clearance.worst(joints, 1e9);
    if (all.slack < 0.3) {
      CHECK(close.slack == Approx(all.slack).margin(1e-6));
      CHECK(close.a == all.a);
    } else {
      CHECK(close.a.empty());
    }
  }
}

TEST_CASE("two arms that meet are seen to meet, and bodies move no further than the bound") {
  Bench bench;
  CHECK(bench.clearance.min_distance(bench.home) > 0.3);
  Random random(4, "bound");
  for (int n = 0; n < 50; ++n) {
    ArmPair moved = bench.home;
    for (std::size_t i = 0; i < 6; ++i) moved.replica[i] += random.uniform(-0.03, 0.03);
    const double bound = bench.clearance.approach_bound(bench.home, moved);
    for (const Vector3d& vertex : bench.cell.target.mesh.vertices) {
      const Vector3d a = bench.cell.replica.tool_pose(bench.home.replica) * vertex;
      const Vector3d b = bench.cell.replica.tool_pose(moved.replica) * vertex;
      CHECK((a - b).norm() <= bound);
    }
  }
}

TEST_CASE("the boxes cover the target and leave out the empty corners") {
  const Mesh mesh = load_target("radarsat2", 0).mesh;
  const std::vector<Box> boxes = cover_with_boxes(mesh, 10);
  CHECK(boxes.size() == 10);
  Random random(5, "points of the mesh");
  for (int n = 0; n < 2000; ++n) {
    const auto& triangle = mesh.triangles[static_cast<std::size_t>(
        random.uniform(0, static_cast<double>(mesh.triangles.size())))];
    double u = random.uniform();
    double v = random.uniform();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Vector3d& a = mesh.vertices[triangle[0]];
    const Vector3d point =
        a + u * (mesh.vertices[triangle[1]] - a) + v * (mesh.vertices[triangle[2]] - a);
    bool covered = false;
    for (const Box& box : boxes) {
      covered = covered ||
                ((point - box.low).minCoeff() > -1e-9 && (box.high - point).minCoeff() > -1e-9);
    }
    CHECK(covered);
  }
  double volume = 0;
  for (const Box& box : boxes) volume += box.size().prod();
  CHECK(volume < 0.8 * bounding_box(mesh).size().prod());
}

TEST_CASE("an unknown key in the settings is refused by file and line") {
  CHECK_THROWS_WITH(load_settings("config/layouts/range.yaml"), Contains("range.yaml"));
}

}  // namespace
}  // namespace berth::testbed
