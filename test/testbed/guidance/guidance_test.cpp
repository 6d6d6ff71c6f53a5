// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/guidance.h"

#include "common/targets/target.h"
#include "test/catch.h"

namespace berth::testbed {
namespace {

using Catch::Matchers::Contains;

/// The replica is where it was commanded a dead time before, or off by so much in the sensor frame;
/// seen once a second as the given transformation of where it is.
struct Flight {
  RayCaster caster{load_target("radarsat2", 0).mesh};
  Guidance guidance{caster, Guidance::Settings{}};
  std::int64_t now = 1000000;
  std::deque<Pose> commanded;
  std::function<Pose(const Pose&)> seen = [](const Pose& pose) { return pose; };
  Pose where;
  Pose off;
  Guidance::Output output;

  explicit Flight(const Pose& start) : where(start) {
    for (int i = 0; i < 100; ++i) idle(start);
    look();
  }
  void idle(const Pose& pose) {
    guidance.note_commanded(now, pose);
    commanded.push_back(pose);
    now += 10000;
  }
  void look() {
    Estimate estimate{now - 10000, seen(where), true, "good"};
    estimate.dead_time = 150000;
    guidance.on_estimate(estimate);
  }
  void fly(double seconds) {
    for (int i = 0; i < static_cast<int>(seconds * 100); ++i) {
      output = guidance.step(now, 0.01);
      commanded.push_back(output.commanded);
      where = off * commanded[commanded.size() - 16];
      now += 10000;
      if (i % 100 == 99) look();
      if (output.phase == Guidance::Phase::done) return;
    }
  }
};

const Pose start = pose_from_xyzwpr({50, -40, 5500, 5, -8, 10});

TEST_CASE("the approach is straight along the boresight and ends at the standoff") {
  Flight flight(start);
  RelativeLimits limits;
  limits.speed = 0.05;
  REQUIRE_FALSE(flight.guidance.approach(flight.now, start, 4.0, limits));
  const Pose end = flight.guidance.predicted_end();
  CHECK((end.position - start.position).head<2>().norm() < 1e-9);
  double fastest = 0;
  double fastest_change = 0;
  Vector3d velocity = Vector3d::Zero();
  for (int i = 0; i < 6000 && flight.output.phase != Guidance::Phase::done; ++i) {
    const Pose before = flight.commanded.back();
    flight.fly(0.01);
    if (i % 100 == 0) flight.look();
    const Vector3d v = (flight.commanded.back().position - before.position) / 0.01;
    fastest = std::max(fastest, v.norm());
    fastest_change = std::max(fastest_change, (v - velocity).norm() / 0.01);
    velocity = v;
  }
  CHECK(flight.output.phase == Guidance::Phase::done);
  CHECK(distance(flight.where, end) < 1e-3);
  CHECK(fastest < 0.0505);
  CHECK(fastest_change < 0.2);  // m/s^2: no step in speed
}

TEST_CASE("a target that looks the same turned by half a turn is approached all the same") {
  Flight flight(start);
  flight.seen = [](const Pose& pose) {
    return pose * Pose{Vector3d::Zero(), Quaterniond(0, 1, 0, 0)};
  };
  flight.look();
  RelativeLimits limits;
  limits.speed = 0.1;
  REQUIRE_FALSE(flight.guidance.approach(flight.now, start, 4.0, limits));
  CHECK(degrees(flight.guidance.initial_angle()) == Approx(180.0).margin(1e-6));
  flight.fly(4);
  CHECK(angle_between(flight.where, start) < 1e-6);
  flight.off.rotation = rotation_from_vector(Vector3d(0.01, 0.005, -0.005));
  flight.fly(60);
  CHECK(flight.output.phase == Guidance::Phase::done);
  CHECK(angle_between(flight.where, start) < 0.001);
}

TEST_CASE("an approach is refused without a good estimate, or from within the standoff") {
  Flight flight(start);
  const RelativeLimits limits;
  auto reason = flight.guidance.approach(flight.now, start, 5.4, limits);
  REQUIRE(reason);
  CHECK_THAT(*reason, Contains("nearer than the standoff"));
  flight.guidance.on_estimate({flight.now - 10000, start, false, "ambiguous"});
  reason = flight.guidance.approach(flight.now, start, 4.0, limits);
  REQUIRE(reason);
  CHECK_THAT(*reason, Contains("ambiguous"));
  flight.look();
  reason = flight.guidance.approach(flight.now + 4000000, start, 4.0, limits);
  REQUIRE(reason);
  CHECK_THAT(*reason, Contains("s old"));
  reason = flight.guidance.approach(
      flight.now, start * Pose{Vector3d(0.4, 0, 0), Quaterniond::Identity()}, 4.0, limits);
  CHECK_FALSE(reason);  // the history has the commanded positions of the arms
}

TEST_CASE("the estimate is flown by wherever the arms were commanded to be") {
  Flight flight(start);
  flight.seen = [](const Pose& pose) {
    return pose * Pose{Vector3d(0.1, 0.2, -0.4), rotation_from_vector(Vector3d(0, 0.4, 0.1))};
  };
  flight.look();
  RelativeLimits limits;
  limits.speed = 0.1;
  REQUIRE_FALSE(flight.guidance.approach(flight.now, start, 4.0, limits));
  flight.fly(60);
  CHECK(flight.output.phase == Guidance::Phase::done);
  const Vector3d sensor = flight.seen(flight.where).inverse().position;
  CHECK((flight.caster.nearest(sensor) - sensor).norm() == Approx(4.0).margin(1e-3));
}

TEST_CASE("an estimate is taken as it is, and worked off at the speed of corrections") {
  Flight flight(start);
  REQUIRE_FALSE(flight.guidance.keep(flight.now, start, start, {}));
  Pose displaced = start;
  displaced.position.x() += 0.015;
  Estimate estimate{flight.now - 10000, displaced, true, "good"};
  estimate.dead_time = 150000;
  flight.guidance.on_estimate(estimate);
  Pose last = start;
  for (int i = 0; i < 200; ++i) {
    const Pose commanded = flight.guidance.step(flight.now, 0.01).commanded;
    CHECK(distance(commanded, last) < 1.001 * 0.01 * Guidance::Settings{}.correction_speed);
    last = commanded;
    flight.now += 10000;
  }
  CHECK(last.position.x() == Approx(start.position.x() - 0.015).margin(1e-9));
  CHECK(angle_between(last, start) < 1e-9);
}

TEST_CASE("an older estimate than the last is ignored") {
  Flight flight(start);
  flight.guidance.on_estimate({flight.now - 5000000, Pose{}, false, "late"});
  CHECK_FALSE(flight.guidance.approach(flight.now, start, 4.0, {}));
}

}  // namespace
}  // namespace berth::testbed
