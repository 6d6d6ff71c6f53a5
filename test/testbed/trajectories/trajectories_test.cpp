// SPDX-License-Identifier: BSD-3-Clause
#include <berth/testbed_command2_t.hpp>
#include <cmath>
#include <limits>

#include "common/bus/bus.h"
#include "common/core/random.h"
#include "test/catch.h"
#include "testbed/trajectories/recorded.h"
#include "testbed/trajectories/trajectory.h"

using namespace berth;
using namespace berth::testbed;

namespace {

const Pose start = pose_from_xyzwpr({100, -50, 5000, 10, 8, -12});

/// Greatest rates along a trajectory as the testbed flies it.
struct Rates {
  double speed = 0, acceleration = 0, angular_speed = 0, angular_acceleration = 0;
};

Rates rates_of(const Waypoints& waypoints) {
  const WaypointPath path(waypoints);
  constexpr double dt = 0.02;
  Rates rates;
  Velocity before;
  for (double t = 0; t < path.duration() + dt; t += dt) {
    const Velocity now = velocity_between(path.at(t).pose, path.at(t + dt).pose, dt);
    rates.speed = std::max(rates.speed, now.linear.norm());
    rates.angular_speed = std::max(rates.angular_speed, now.angular.norm());
    rates.acceleration = std::max(rates.acceleration, (now.linear - before.linear).norm() / dt);
    rates.angular_acceleration =
        std::max(rates.angular_acceleration, (now.angular - before.angular).norm() / dt);
    before = now;
  }
  return rates;
}

/// What holds of every trajectory: it begins here, fits one message, times increase, and it neither
/// begins nor ends with a jerk.
void check_common(const Waypoints& waypoints) {
  REQUIRE(waypoints.size() >= 2);
  CHECK(waypoints.front().time == 0);
  CHECK(distance(waypoints.front().pose, start) < 1e-9);
  CHECK(angle_between(waypoints.front().pose, start) < 1e-7);
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    REQUIRE(waypoints[i].time > waypoints[i - 1].time);
  }
  testbed_command2_t command{};
  command.commander = "procedure";
  command.waypoint_count = static_cast<std::int32_t>(waypoints.size());
  command.waypoints.resize(waypoints.size());
  CHECK(command.getEncodedSize() < Bus::max_message_bytes);
  const Rates rates = rates_of(waypoints);
  CHECK(rates.acceleration < 0.5);
  CHECK(rates.angular_acceleration < radians(10));
}

Vector3d end_of(const Waypoints& waypoints) {
  return waypoints.back().pose.position - start.position;
}

}  // namespace

TEST_CASE("straight on: the displacement along the sensor's axes at the requested speed") {
  Straight options;
  options.by = pose_from_xyzwpr({0, 0, -300, 0, 5, 0});
  options.speed = 0.03;
  const Waypoints waypoints = straight(start, options);
  check_common(waypoints);
  CHECK((end_of(waypoints) - Vector3d(0, 0, -0.3)).norm() < 1e-9);
  CHECK(angle_between(waypoints.back().pose, start) == Approx(radians(5)));
  CHECK(rates_of(waypoints).speed == Approx(0.03).epsilon(0.01));
  // A turn that would be too fast at that speed sets the pace.
  options.angular_speed = radians(0.2);
  CHECK(rates_of(straight(start, options)).angular_speed == Approx(radians(0.2)).epsilon(0.01));
}

TEST_CASE("an approach on a bar stands still at its hold points and bulges only between them") {
  BarApproach options;
  options.to = 3.8;
  options.holds = {4.6, 4.2};
  options.hold_for = 10;
  options.speed = 0.05;
  options.bulge = 0.03;
  const Waypoints waypoints = bar_approach(start, options);
  check_common(waypoints);
  CHECK(waypoints.back().pose.position.z() == Approx(3.8));
  double still[2] = {0, 0};
  double widest = 0;
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    const Vector3d p = waypoints[i].pose.position;
    const double dt = waypoints[i].time - waypoints[i - 1].time;
    const bool rests = (p - waypoints[i - 1].pose.position).norm() < 1e-7;
    for (int k : {0, 1}) {
      if (!rests || std::abs(p.z() - options.holds[static_cast<std::size_t>(k)]) > 1e-6) continue;
      still[k] += dt;
      CHECK(p.y() == Approx(start.position.y()).margin(1e-6));
    }
    widest = std::max(widest, p.y() - start.position.y());
    CHECK(p.x() == Approx(start.position.x()));
  }
  CHECK(still[0] == Approx(10).margin(0.6));
  CHECK(still[1] == Approx(10).margin(0.6));
  CHECK(widest == Approx(0.03).epsilon(0.01));
  CHECK(rates_of(waypoints).speed < 0.07);
}

TEST_CASE("an oscillation is fast, goes no farther than its amplitude and comes back") {
  Oscillation options;
  options.axis = {1, 1, 0};
  options.amplitude = 0.15;
  options.speed = 0.25;
  options.cycles = 3;
  const Waypoints waypoints = oscillation(start, options);
  check_common(waypoints);
  CHECK(end_of(waypoints).norm() < 1e-9);
  CHECK(rates_of(waypoints).speed == Approx(0.25).epsilon(0.02));
  double farthest = 0;
  for (const auto& w : waypoints) {
    const Vector3d off = w.pose.position - start.position;
    farthest = std::max(farthest, off.norm());
    CHECK(off.cross(Vector3d(1, 1, 0)).norm() < 1e-9);
  }
  CHECK(farthest == Approx(0.15).epsilon(0.01));
}

TEST_CASE("a spiral goes outwards at constant speed across the boresight") {
  Spiral options;
  options.radius = 0.2;
  options.turns = 2.5;
  const Waypoints waypoints = spiral(start, options);
  check_common(waypoints);
  CHECK((end_of(waypoints) - Vector3d(-0.2, 0, 0)).norm() < 1e-6);
  double before = 0;
  for (const auto& w : waypoints) {
    const double radius = (w.pose.position - start.position).norm();
    CHECK(radius >= before - 1e-9);
    before = radius;
    CHECK(w.pose.position.z() == Approx(start.position.z()));
  }
  CHECK(rates_of(waypoints).speed == Approx(options.speed).epsilon(0.03));
}

TEST_CASE("drift stays inside its dead band in each axis and uses it") {
  Drift options;
  options.duration = 200;
  const Waypoints waypoints = drift(start, options);
  check_common(waypoints);
  Vector6d most = Vector6d::Zero();
  for (const auto& w : waypoints) {
    most = most.cwiseMax(difference(start, w.pose).cwiseAbs());
  }
  for (int i = 0; i < 3; ++i) CHECK(most[i] == Approx(options.amplitude).epsilon(0.02));
  CHECK(most.tail<3>().norm() > options.turn);
  CHECK(most.tail<3>().norm() < 2 * options.turn);
}

TEST_CASE("a fly-around turns the replica about its own origin") {
  for (const double angle : {radians(40), radians(-200)}) {
    FlyAround options;
    options.angle = angle;
    options.axis = {0, 2, 0};
    options.speed = radians(4);
    const Waypoints waypoints = fly_around(start, options);
    check_common(waypoints);
    for (const auto& w : waypoints) REQUIRE(distance(w.pose, start) == 0);
    const Quaterniond expected = rotation_from_vector(Vector3d(0, angle, 0)) * start.rotation;
    CHECK(waypoints.back().pose.rotation.angularDistance(expected) < 1e-9);
    CHECK(rates_of(waypoints).angular_speed == Approx(radians(4)).epsilon(0.01));
  }
}

TEST_CASE("a free body keeps its energy and its angular momentum, whatever its shape and spin") {
  Random random(1, "tumble");
  for (int i = 0; i < 20; ++i) {
    Vector3d inertia(random.uniform(1, 2), random.uniform(1, 2), random.uniform(1, 2));
    TorqueFreeBody body(random.rotation(), inertia, random.normal_vector(0.5));
    const double energy = body.energy();
    const Vector3d momentum = body.momentum();
    for (int s = 0; s < 60; ++s) body.advance(1);
    CHECK(std::abs(body.energy() / energy - 1) < 1e-9);
    CHECK((body.momentum() - momentum).norm() < 1e-8 * momentum.norm());
  }
}

TEST_CASE("free bodies turn as theory has it") {
  // Symmetric: the spin axis goes around the symmetry axis at (I3 - I1) / I1 w3 (Euler, 1765).
  TorqueFreeBody top(Quaterniond::Identity(), {1, 1, 1.5}, {0.2, 0, 1});
  const double period = 2 * M_PI / 0.5;
  top.advance(period / 4);
  CHECK((top.rate() - Vector3d(0, 0.2, 1)).norm() < 1e-8);
  // About the middle axis it turns over (the tennis racket), about the others it does not.
  const auto lowest = [](const Vector3d& rate, int axis) {
    TorqueFreeBody body(Quaterniond::Identity(), {1, 2, 3}, rate);
    double least = rate[axis];
    for (int i = 0; i < 600; ++i) {
      body.advance(0.1);
      least = std::min(least, body.rate()[axis]);
    }
    return least;
  };
  CHECK(lowest({1, 0.01, 0.01}, 0) > 0.9);
  CHECK(lowest({0.01, 1, 0.01}, 1) < -0.9);
  CHECK(lowest({0.01, 0.01, 1}, 2) > 0.9);
}

TEST_CASE("a tumble comes from rest to the body's own spin, and to rest") {
  Tumble options;
  options.inertia = {1, 2, 3};
  options.rate = {radians(1), radians(3), radians(0.5)};
  options.duration = 60;
  const Waypoints waypoints = tumble(start, options);
  check_common(waypoints);
  for (const auto& w : waypoints) REQUIRE(distance(w.pose, start) == 0);
  // Between the ramps it is the body, at its time.
  TorqueFreeBody body(start.rotation, options.inertia, options.rate);
  const SmoothTravel time = eased_time(options.duration, options.ramp);
  const auto& middle = waypoints[waypoints.size() / 2];
  body.advance(time.position(middle.time));
  CHECK(body.attitude().angularDistance(middle.pose.rotation) < 1e-7);
}

TEST_CASE("a long trajectory still fits one message, and its waypoints still make its motion") {
  Drift options;
  options.duration = 1800;
  const Waypoints waypoints = drift(start, options);
  check_common(waypoints);
  Drift shorter = options;
  shorter.duration = 30;
  const WaypointPath coarse(waypoints);
  const WaypointPath fine(drift(start, shorter));
  for (double t = 0; t < 25; t += 0.1) {
    CHECK(distance(coarse.at(t).pose, fine.at(t).pose) < 3e-3);
  }
}

TEST_CASE("a recorded motion is flown again without its noise, from any start") {
  Random random(8, "recorded");
  Waypoints samples;
  const auto flown = [](double t) {
    return Pose{Vector3d(0.1 * std::sin(0.3 * t), 0, 5 - 0.04 * t),
                rotation_from_vector(Vector3d(0, 0.1 * std::sin(0.2 * t), 0))};
  };
  for (int i = 0; i <= 2500; ++i) {  // 125 Hz for 20 s, 1 mm and 0.05 deg of noise
    Vector6d noise;
    noise << random.normal_vector(1e-3), random.normal_vector(radians(0.05));
    samples.push_back({0.008 * i, perturbed(flown(0.008 * i), noise)});
  }
  const Pose here{Vector3d(0.05, 0, 5.2), Quaterniond::Identity()};
  Recorded options;
  // kept as text in between
  options.places = read_poses(trajectory_text(smoothed(samples, 0.25)), "run");
  const Waypoints waypoints = recorded(here, options);
  CHECK(distance(waypoints.front().pose, here) < 1e-9);
  CHECK(distance(waypoints.back().pose, flown(20)) < 2e-3);
  // In its middle it keeps the record's own pace: some time after, the same places.
  const WaypointPath path(waypoints);
  const double later = path.duration() - 20 - options.ramp / 2;
  for (double t = 3; t < 17; t += 0.1) {
    CHECK(distance(path.at(t + later).pose, flown(t)) < 1.5e-3);
    CHECK(degrees(angle_between(path.at(t + later).pose, flown(t))) < 0.05);
  }
}
