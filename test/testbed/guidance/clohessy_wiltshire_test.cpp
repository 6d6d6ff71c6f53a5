// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/clohessy_wiltshire.h"

#include <numbers>

#include "common/core/random.h"
#include "test/catch.h"
#include "testbed/guidance/chaser.h"

namespace berth::testbed {
namespace {

const double orbit_rate = mean_motion(798e3);

/// Fourth-order Runge-Kutta, small steps.
HillState integrated(HillState s, const Vector3d& thrust, double duration) {
  const int steps = 2000;
  const double dt = duration / steps;
  const auto rate = [&](const HillState& x) {
    return HillState{x.velocity, relative_gravity(x, orbit_rate) + thrust};
  };
  const auto on = [](const HillState& x, const HillState& r, double h) {
    return HillState{x.position + h * r.position, x.velocity + h * r.velocity};
  };
  for (int i = 0; i < steps; ++i) {
    const HillState a = rate(s);
    const HillState b = rate(on(s, a, dt / 2));
    const HillState c = rate(on(s, b, dt / 2));
    const HillState d = rate(on(s, c, dt));
    s = on(on(on(on(s, a, dt / 6), b, dt / 3), c, dt / 3), d, dt / 6);
  }
  return s;
}

HillState any_state(Random& random) {
  return {random.normal_vector(50.0), random.normal_vector(0.2)};
}

TEST_CASE("mean motion: a geostationary satellite goes round once in a sidereal day") {
  CHECK(2 * std::numbers::pi / mean_motion(35786e3) == Approx(86164).epsilon(1e-4));
  CHECK(2 * std::numbers::pi / orbit_rate / 60 ==
        Approx(100.8).epsilon(1e-3));  // Radarsat-2, minutes
}

TEST_CASE("propagation is that of the differential equations, thrust and all") {
  Random random(3, "clohessy-wiltshire");
  for (int i = 0; i < 50; ++i) {
    const HillState start = any_state(random);
    const Vector3d thrust = random.normal_vector(0.02);
    const double duration = random.uniform(0.01, 8000.0);
    const HillState exact = propagated(start, thrust, orbit_rate, duration);
    const HillState numeric = integrated(start, thrust, duration);
    const double scale = 1 + exact.position.norm();
    CHECK((exact.position - numeric.position).norm() / scale < 1e-8);
    CHECK((exact.velocity - numeric.velocity).norm() / (orbit_rate * scale) < 1e-6);
    // in two steps as in one
    const HillState half = propagated(start, thrust, orbit_rate, 0.3 * duration);
    const HillState again = propagated(half, thrust, orbit_rate, 0.7 * duration);
    CHECK((exact.position - again.position).norm() / scale < 1e-9);
  }
  // a set-point's step is no worse than a long one
  const HillState start = any_state(random);
  HillState stepped = start;
  for (int i = 0; i < 6000; ++i)
    stepped = propagated(stepped, Vector3d::Zero(), orbit_rate, 1.0 / 60);
  CHECK((stepped.position - propagated(start, Vector3d::Zero(), orbit_rate, 100).position).norm() <
        1e-8);
}

TEST_CASE("without drift the relative orbit closes, and keeps its integral") {
  Random random(4, "closed orbits");
  for (int i = 0; i < 20; ++i) {
    HillState start = any_state(random);
    start.velocity.y() = -2 * orbit_rate * start.position.x();
    const HillState round =
        propagated(start, Vector3d::Zero(), orbit_rate, 2 * std::numbers::pi / orbit_rate);
    CHECK((round.position - start.position).norm() < 1e-6);
    CHECK((round.velocity - start.velocity).norm() < 1e-9);
  }
  // the Jacobi integral of the linearised motion: |v|^2 / 2 - 3/2 orbit_rate^2 x^2 + orbit_rate^2
  // z^2 / 2
  const auto energy = [](const HillState& s) {
    return 0.5 * s.velocity.squaredNorm() -
           1.5 * orbit_rate * orbit_rate * s.position.x() * s.position.x() +
           0.5 * orbit_rate * orbit_rate * s.position.z() * s.position.z();
  };
  const HillState start = any_state(random);
  for (const double t : {10.0, 700.0, 5000.0, 20000.0}) {
    const HillState later = propagated(start, Vector3d::Zero(), orbit_rate, t);
    CHECK(energy(later) == Approx(energy(start)).epsilon(1e-9));
  }
}

TEST_CASE("a passively safe burn: left alone, the chaser never comes nearer again") {
  Random random(5, "retreats");
  for (int i = 0; i < 60; ++i) {
    // around the target at 2 to 30 m, closing or drifting at up to 20 cm/s
    const Vector3d direction = random.normal_vector(1.0).normalized();
    const HillState state{random.uniform(2.0, 30.0) * direction, random.normal_vector(0.05)};
    const double max_acceleration = 0.05;
    const Vector3d burn = passively_safe_burn(state, orbit_rate, 0.1, max_acceleration);
    const double time = burn.lpNorm<Eigen::Infinity>() / max_acceleration;
    const HillState burnt = propagated(state, burn / time, orbit_rate, time);
    const double there = burnt.position.norm();
    CHECK(burnt.velocity.dot(burnt.position.normalized()) > 0.08);
    double nearest = 1e9;
    for (double t = 0; t < 2 * 6040; t += 2) {
      nearest = std::min(
          nearest, propagated(burnt, Vector3d::Zero(), orbit_rate, t).position.norm() / there);
    }
    INFO("from " << state.position.transpose() << ", burn " << burn.transpose());
    CHECK(nearest > 0.999);
  }
}

GuidanceProfile vehicle(double thrust) {
  GuidanceProfile profile;
  profile.law = GuidanceProfile::Law::clohessy_wiltshire;
  profile.orbit = {orbit_rate, GuidanceProfile::Bar::v_bar, 5, 2};
  profile.vehicle = {800, thrust, 220};
  return profile;
}

TEST_CASE("a chaser has no more thrust than it has, along each axis of its own") {
  RelativeLimits limits;
  limits.acceleration = 1;  // the arms are not what limits it
  const Pose start = pose_from_xyzwpr({100, 50, 5000, 20, 10, 30}).inverse();
  Chaser chaser(vehicle(40), limits, start);
  // 40 N on 800 kg, seen in the cell: 0.05 m/s^2 * 2^2 / 5
  CHECK(chaser.max_acceleration() == Approx(0.04));
  double before = 0;
  for (int i = 0; i < 600; ++i) {
    chaser.step(1.0 / 60, Vector3d(0.5, -0.2, 0.001), Vector3d::Zero());
    CHECK(chaser.thrust_orbit().cwiseAbs().maxCoeff() <= 0.05 + 1e-12);
    CHECK(chaser.delta_v_orbit() >= before);
    before = chaser.delta_v_orbit();
  }
  CHECK(chaser.orbit_time() == Approx(20.0));  // two seconds of orbit in one
  // Tsiolkovsky, small: m dv / (Isp g)
  CHECK(chaser.propellant() == Approx(800 * chaser.delta_v_orbit() / (220 * 9.80665)));
}

TEST_CASE("thrusters give their minimum impulse or nothing, and the requested impulse is kept") {
  RelativeLimits limits;
  limits.acceleration = 1;
  const Pose start = pose_from_xyzwpr({0, 0, 4000, 0, 0, 0}).inverse();
  GuidanceProfile coarse = vehicle(40);
  coarse.vehicle.shortest_burn = 0.02;  // of 0.05 m/s^2: 1 mm/s of orbit, 0.4 mm/s of the cell
  const auto velocity_gained = [&](const GuidanceProfile& profile, auto requested) {
    Chaser chaser(profile, limits, start);
    for (int i = 0; i < 600; ++i) {
      chaser.coast(1.0 / 60, Vector3d(requested(i), 0, 0), Vector3d::Zero());
    }
    for (int i = 0; i < 120; ++i) chaser.coast(1.0 / 60, Vector3d::Zero(), Vector3d::Zero());
    return chaser.delta_v_orbit();
  };
  const auto steady = [](int) { return 1e-3; };  // for 10 s of the cell: 25 mm/s of orbit
  CHECK(velocity_gained(vehicle(40), steady) == Approx(0.025).epsilon(1e-3));
  CHECK(velocity_gained(coarse, steady) == Approx(0.025).margin(1.01e-3));
  const auto little = [](int i) { return i < 20 ? 1e-3 : 0.0; };
  CHECK(velocity_gained(vehicle(40), little) > 8e-4);
  CHECK(velocity_gained(coarse, little) == 0);
  const auto to_and_fro = [](int i) { return i % 20 < 10 ? 1e-3 : -1e-3; };
  CHECK(velocity_gained(vehicle(40), to_and_fro) > 5e-3);
  CHECK(velocity_gained(coarse, to_and_fro) == 0);
}

TEST_CASE("a chaser that coasts follows its orbit, scaled to the cell") {
  const Pose start = pose_from_xyzwpr({0, 0, 4000, 0, 0, 0}).inverse();
  Chaser chaser(vehicle(40), RelativeLimits{}, start);
  // behind the target on V-bar: 4 m of cell are 20 m of orbit
  CHECK((chaser.hill().position - Vector3d(0, -20, 0)).norm() < 1e-9);
  const HillState from = chaser.hill();
  for (int i = 0; i < 6000; ++i) chaser.coast(1.0 / 60, Vector3d::Zero(), Vector3d::Zero());
  const HillState to = propagated(from, Vector3d::Zero(), orbit_rate, 200);
  CHECK((chaser.hill().position - to.position).norm() < 1e-9);
  CHECK(chaser.delta_v_orbit() == 0);
  // at rest on V-bar it stays there; above it the orbit is longer, and it falls behind
  CHECK((chaser.pose().position - start.position).norm() < 1e-9);
  Chaser above(vehicle(40), RelativeLimits{}, pose_from_xyzwpr({0, 1000, 4000, 0, 0, 0}).inverse());
  for (int i = 0; i < 6000; ++i) above.coast(1.0 / 60, Vector3d::Zero(), Vector3d::Zero());
  CHECK(above.hill().velocity.x() > 0);
  CHECK(above.hill().position.y() < -20);
}

}  // namespace
}  // namespace berth::testbed
