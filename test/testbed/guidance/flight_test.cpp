// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/flight.h"

#include <deque>

#include "common/core/random.h"
#include "common/targets/target.h"
#include "test/catch.h"
#include "testbed/guidance/forecast.h"
#include "testbed/trajectories/trajectory.h"

namespace berth::testbed {
namespace {

using Catch::Matchers::Contains;
using Doing = GuidanceReport::Phase;

const Target& radarsat() {
  static const Target target = load_target("radarsat2", 0);
  return target;
}
const RayCaster& surface() {
  static const RayCaster caster(radarsat().mesh);
  return caster;
}

GuidanceProfile profile(const std::string& name) {
  return load_guidance_profile("config/guidance/" + name + ".yaml");
}

TargetMotion tumbling(double degrees_per_s, double duration) {
  Tumble tumble_about;
  tumble_about.inertia = Vector3d(0.25, 1, 1.05);
  tumble_about.rate = radians(degrees_per_s) * Vector3d(0.5, 0.6, 0.62).normalized();
  tumble_about.duration = duration;
  return std::make_shared<const WaypointPath>(tumble(Pose{}, tumble_about));
}

/// A chaser whose commands come true a dead time later, and an estimator that looks once a second
/// and needs 0.7 s for it.
struct FlightBench {
  static constexpr std::int64_t step = 16667;
  static constexpr std::int64_t dead_time = 150000;

  Guidance::Settings settings;
  std::int64_t now = 5000000;
  Random random{7, "flight"};
  Pose start;
  TargetMotion motion;
  std::shared_ptr<Flight> flight;
  std::deque<Pose> commanded;  // T_sensor_model, one a step
  Steering::Output output;
  double time = 0;
  double noise = 0.003;           // m
  double velocity_noise = 0.003;  // m/s
  bool silent = false;
  std::string status;  // bad when not empty
  Vector6d offset = Vector6d::Zero();
  std::string refusal;

  FlightBench(const GuidanceProfile& by, const Pose& from, const Flight::Order& order,
              TargetMotion target_motion = {})
      : start(from), motion(std::move(target_motion)) {
    PoseHistory before;
    before.add(now - 2000000, start);
    before.add(now, start);
    commanded.assign(200, start);
    const ApproachTarget target{&surface(), *radarsat().port()};
    auto result =
        Flight::begin(by, target, settings, order, now, start, before, seen(start, start));
    if (auto* reason = std::get_if<std::string>(&result)) {
      refusal = *reason;
    } else {
      flight = std::get<std::shared_ptr<Flight>>(result);
    }
  }
  /// @param before the pose a step earlier
  Estimate seen(const Pose& before, const Pose& pose) {
    Vector6d error = offset;
    error.head<3>() += random.normal_vector(noise);
    error.tail<3>() += random.normal_vector(0.5 * noise);
    Estimate estimate;
    estimate.utime = now;
    estimate.dead_time = dead_time;
    estimate.pose = perturbed(pose, error);
    Velocity velocity = velocity_between(before, pose, 1e-6 * step);
    velocity.linear += random.normal_vector(velocity_noise);
    velocity.angular += random.normal_vector(0.5 * velocity_noise);
    estimate.velocity = velocity;
    estimate.usable = status.empty();
    estimate.status = status;
    return estimate;
  }
  /// Where the target truly is in the sensor frame now.
  const Pose& truth() const { return commanded[commanded.size() - 1 - dead_time / step]; }
  void fly(double duration) {
    for (double t = 0; t < duration; t += 1e-6 * step) {
      now += step;
      time += 1e-6 * step;
      output = flight->step(now, 1e-6 * step);
      commanded.push_back(output.commanded * target_at(motion, time));
      constexpr std::size_t ago = 700000 / step;
      if (commanded.size() % 60 == 0 && !silent) {
        const std::size_t shown = commanded.size() - 1 - ago - dead_time / step;
        Estimate estimate = seen(commanded[shown - 1], commanded[shown]);
        estimate.utime = now - static_cast<std::int64_t>(ago) * step;
        flight->on_estimate(estimate);
      }
      if (output.phase == Steering::Phase::done || output.phase == Steering::Phase::aborted) return;
    }
  }
  bool fly_until(Doing phase, double limit) {
    for (double t = 0; t < limit; t += 0.1) {
      fly(0.1);
      if (flight->report().phase == phase) return true;
    }
    return false;
  }
  Vector3d interface() const { return truth() * radarsat().port()->pose.position; }
};

Flight::Order dock_at(double standoff, double speed) {
  Flight::Order order;
  order.standoff = standoff;
  order.dock = true;
  order.limits.speed = speed;
  return order;
}

const Pose askew = pose_from_xyzwpr({80, -60, 4800, 6, -8, 10});

TEST_CASE("a flight ends in front of the docking interface, by each law") {
  for (const char* name : {"docking_axis", "v_bar", "r_bar"}) {
    INFO(name);
    FlightBench bench(profile(name), askew, dock_at(3.2, 0.05));
    REQUIRE(bench.refusal == "");
    double fastest = 0;
    while (bench.output.phase != Steering::Phase::done && bench.time < 200) {
      const Pose before = bench.commanded.back();
      bench.fly(1.0 / 60);
      fastest = std::max(fastest, bench.flight->report().closing_speed);
      REQUIRE(distance(before, bench.commanded.back()) < 0.3 / 60 * 1.3);
    }
    REQUIRE(bench.output.phase == Steering::Phase::done);
    CHECK(bench.output.reason == "");
    CHECK(fastest < 0.05 + 4 * bench.velocity_noise);
    CHECK(bench.interface().z() == Approx(3.2).margin(0.03));
    CHECK(bench.interface().head<2>().norm() < 0.03);
    const Vector3d out =
        bench.truth().rotation * radarsat().port()->pose.rotation * Vector3d::UnitZ();
    CHECK(degrees(std::acos(-out.z())) < 1.0);
    const GuidanceReport report = bench.flight->report();
    CHECK((report.delta_v_orbit > 0) == (report.law == "clohessy_wiltshire"));
  }
}

TEST_CASE("a turning target is followed in front of its docking face") {
  for (const double rate : {1.0, 3.0}) {
    INFO(rate << " deg/s");
    const Pose from = pose_from_xyzwpr({0, 0, 4200, 0, 0, 0});
    FlightBench bench(profile("docking_axis"), from, dock_at(3.2, 0.05), tumbling(rate, 60));
    REQUIRE(bench.refusal == "");
    bench.fly(20);
    double worst_offset = 0;
    double worst_angle = 0;
    while (bench.output.phase == Steering::Phase::flying && bench.time < 58) {
      bench.fly(0.2);
      worst_offset = std::max(worst_offset, bench.interface().head<2>().norm());
      const Vector3d out =
          bench.truth().rotation * radarsat().port()->pose.rotation * Vector3d::UnitZ();
      worst_angle = std::max(worst_angle, std::acos(std::min(1.0, -out.z())));
    }
    CHECK(worst_offset < 0.06);
    CHECK(degrees(worst_angle) < 2.5);
    REQUIRE(bench.output.phase == Steering::Phase::done);
    // the chaser has flown around the target as far as it turned
    const double turned = angle_between(target_at(bench.motion, bench.time), Pose{});
    CHECK(turned > radians(15.0));
    CHECK(angle_between(bench.flight->commanded(), Pose{}) == Approx(turned).margin(0.06));
  }
}

TEST_CASE("on a line of target_state the target's turning is seen, not followed") {
  const Pose from = pose_from_xyzwpr({0, 0, 4600, 0, 0, 0});
  Flight::Order order = dock_at(3.6, 0.05);
  order.dock = false;
  FlightBench bench(profile("line_of_sight"), from, order, tumbling(2, 10));
  REQUIRE(bench.refusal == "");
  bench.fly(100);
  REQUIRE(bench.output.phase == Steering::Phase::done);
  CHECK(angle_between(bench.flight->commanded(), Pose{}) < 0.02);
  const Vector3d eye = bench.truth().inverse().position;
  CHECK((surface().nearest(eye) - eye).norm() == Approx(3.6).margin(0.03));
}

TEST_CASE("a hold point is kept for its dwell, and not left while out of its conditions") {
  GuidanceProfile by = profile("docking_axis");
  by.hold_points = {{4.0, 8.0}};
  FlightBench bench(by, pose_from_xyzwpr({0, 0, 4600, 0, 0, 0}), dock_at(3.4, 0.05));
  REQUIRE(bench.fly_until(Doing::at_hold_point, 60));
  CHECK(bench.flight->report().hold_point == 0);
  const double arrived = bench.time;
  REQUIRE(bench.fly_until(Doing::approaching, 60));
  CHECK(bench.time - arrived == Approx(8).margin(0.5));

  by.go_on.offset = 0.001;  // never fulfilled by an estimate with 3 mm of noise
  by.go_on.patience = 10;
  FlightBench strict(by, pose_from_xyzwpr({0, 0, 4600, 0, 0, 0}), dock_at(3.4, 0.05));
  REQUIRE(strict.fly_until(Doing::at_hold_point, 60));
  REQUIRE(strict.fly_until(Doing::retreating, 60));
  CHECK_THAT(strict.flight->report().reason, Contains("hold point"));
}

TEST_CASE("the last stretch is flown at the speed of contact") {
  GuidanceProfile by = profile("docking_axis");
  by.final = {3.8, 0.01};
  FlightBench bench(by, pose_from_xyzwpr({0, 0, 4600, 0, 0, 0}), dock_at(3.4, 0.05));
  REQUIRE(bench.fly_until(Doing::final, 60));
  bench.fly(3);
  while (bench.output.phase == Steering::Phase::flying && bench.time < 120) {
    bench.fly(0.5);
    CHECK(bench.flight->report().closing_speed < 0.02);
  }
  CHECK(bench.flight->report().phase == Doing::contact);
}

TEST_CASE("lost, stale, ambiguous or implausible: held for a while, then back from the target") {
  for (const std::string name : {"docking_axis", "v_bar"}) {
    for (const std::string what : {"lost", "ambiguous", "stale", "wrong"}) {
      INFO(name << ", " << what);
      FlightBench bench(profile(name), pose_from_xyzwpr({0, 0, 4700, 0, 0, 0}), dock_at(3.2, 0.05));
      bench.fly(12);
      REQUIRE(bench.flight->report().phase == Doing::approaching);
      if (what == "stale") bench.silent = true;
      if (what == "lost" || what == "ambiguous") bench.status = what;
      if (what == "wrong") bench.offset << 0, 0, 0.5, 0, 0, 0;
      REQUIRE(bench.fly_until(Doing::holding, 6));
      CHECK(bench.output.phase == Steering::Phase::holding);
      REQUIRE(bench.fly_until(Doing::retreating, 8));
      const double nearest = bench.truth().position.norm();
      const double began = bench.time;
      const double closing = bench.flight->report().closing_speed;
      double nearest_in_retreat = nearest;
      bench.silent = true;
      while (bench.output.phase != Steering::Phase::aborted && bench.time - began < 100) {
        bench.fly(0.1);
        nearest_in_retreat = std::min(nearest_in_retreat, bench.truth().position.norm());
      }
      REQUIRE(bench.output.phase == Steering::Phase::aborted);
      // braking and the dead time, then never nearer again
      CHECK(nearest_in_retreat > nearest - 0.01 - 0.15 * closing - closing * closing / 0.02);
      CHECK(bench.truth().position.norm() > nearest + 0.3);
      CHECK_THAT(bench.output.reason, Contains(what == "stale"   ? "s old"
                                               : what == "wrong" ? "expected"
                                                                 : what));
    }
  }
}

TEST_CASE("an estimate that comes back in time lets the flight go on") {
  FlightBench bench(profile("v_bar"), pose_from_xyzwpr({0, 0, 4700, 0, 0, 0}), dock_at(3.2, 0.05));
  bench.fly(12);
  bench.status = "lost";
  REQUIRE(bench.fly_until(Doing::holding, 3));
  bench.fly(0.5);
  bench.status.clear();
  REQUIRE(bench.fly_until(Doing::approaching, 4));
  bench.fly(100);
  CHECK(bench.output.phase == Steering::Phase::done);
}

TEST_CASE("out of the corridor: back at once") {
  // a target that jerks aside faster than the chaser can follow
  GuidanceProfile by = profile("docking_axis");
  by.corridor = {0.03, radians(1.0)};
  std::vector<WaypointPath::Waypoint> points{{0, Pose{}}, {14, Pose{}}};
  for (int i = 1; i <= 40; ++i) {
    points.push_back({14 + 0.25 * i, {Vector3d(0.02 * i, 0, 0), Quaterniond::Identity()}});
  }
  FlightBench bench(by, pose_from_xyzwpr({0, 0, 4700, 0, 0, 0}), dock_at(3.2, 0.05),
                    std::make_shared<const WaypointPath>(points));
  REQUIRE(bench.fly_until(Doing::retreating, 30));
  CHECK_THAT(bench.flight->report().reason, Contains("off the axis"));
}

TEST_CASE("what cannot be flown is refused: too near, off the axis, no estimate") {
  const GuidanceProfile by = profile("docking_axis");
  CHECK_THAT(FlightBench(by, pose_from_xyzwpr({0, 0, 3000, 0, 0, 0}), dock_at(3.2, 0.05)).refusal,
             Contains("nearer than the standoff"));
  CHECK_THAT(FlightBench(by, pose_from_xyzwpr({0, 0, 4800, 0, 75, 0}), dock_at(3.2, 0.05)).refusal,
             Contains("off the docking axis"));
  auto none = Flight::begin(by, {&surface(), *radarsat().port()}, {}, dock_at(3, 0.05), 0, askew,
                            PoseHistory{}, std::nullopt);
  CHECK(std::get<std::string>(none) == "there is no estimate");
}

TEST_CASE("the forecast is what a perfect estimate makes of the flight") {
  const Pose from = pose_from_xyzwpr({40, -30, 4600, 3, -2, 4});
  FlightBench bench(profile("v_bar"), from, dock_at(3.3, 0.05), tumbling(1, 40));
  bench.noise = 0;
  REQUIRE(bench.flight);
  const auto result = forecast(*bench.flight, bench.motion, bench.now, FlightBench::dead_time);
  REQUIRE(std::holds_alternative<std::shared_ptr<const RelativePath>>(result));
  const auto path = std::get<std::shared_ptr<const RelativePath>>(result);
  CHECK(distance(path->at(0).pose, from) < 1e-9);
  double worst = 0;
  while (bench.output.phase != Steering::Phase::done && bench.time < 100) {
    bench.fly(0.5);
    worst = std::max(worst, distance(path->at(bench.time).pose, bench.commanded.back()));
  }
  CHECK(bench.time == Approx(path->duration()).margin(3));
  CHECK(worst < 0.12);  // when the scans fall is not the same
}

TEST_CASE("a pose is kept against a target that turns") {
  const Pose pose = pose_from_xyzwpr({30, 20, 4500, 2, -3, 4});
  Flight::Order order;
  order.keep = true;
  order.pose = pose;
  FlightBench bench(profile("docking_axis"), pose, order, tumbling(2, 20));
  REQUIRE(bench.refusal == "");
  bench.fly(12);
  double worst = 0;
  for (int i = 0; i < 16; ++i) {
    bench.fly(0.5);
    worst = std::max(worst, distance(bench.truth(), pose));
  }
  CHECK(worst < 0.08);
  bench.fly(20);  // the target has stopped, which the chaser could not know
  CHECK(distance(bench.truth(), pose) < 0.02);
  CHECK(bench.flight->report().phase == Doing::station_keeping);
}

}  // namespace
}  // namespace berth::testbed
