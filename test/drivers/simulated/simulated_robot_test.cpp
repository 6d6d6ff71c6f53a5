// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_robot.h"

#include <algorithm>
#include <cmath>

#include "common/core/random.h"
#include "test/catch.h"

namespace berth {
namespace {

/// A robot that gets a set-point and a heartbeat every 16 ms.
struct Fed {
  explicit Fed(const SimulatedRobot::Options& options = {})
      : robot(ArmKinematics::load("config/arms/m710ic_50.yaml"), options, home, 0) {
    robot.set_follow(true);
    robot.take_heartbeat(0);
    robot.start(0);
  }
  /// Feeds path(s) until `end`, calls look(t) every millisecond.
  template <class Path, class Look>
  void feed(Utime end, Path path, Look look) {
    while (now < end) {
      now += millisecond;
      robot.advance(now);
      if (now % (16 * millisecond) == 0) {
        robot.take_heartbeat(now);
        robot.take_setpoint(path(seconds(now)), ++sequence,
                            static_cast<int>(now / millisecond) % (1 << 24), now);
      }
      look(now);
    }
  }
  template <class Path>
  void feed(Utime end, Path path) {
    feed(end, path, [](Utime) {});
  }
  Joints here() { return robot.joints_at(now); }

  Joints home{0, 0.1, -0.2, 0, -0.5, 0};
  SimulatedRobot robot;
  Utime now = 0;
  int sequence = 0;
};

TEST_CASE("a ramp of set-points is followed 150 ms late at its own speed") {
  Fed fed;
  const auto path = [&](double t) {
    Joints joints = fed.home;
    joints[0] += 0.2 * t;
    return joints;
  };
  fed.feed(140 * millisecond, path);
  CHECK(fed.here() == fed.home);
  fed.feed(3 * second, path, [&](Utime t) {
    if (t > second) {
      CHECK(fed.robot.joints_at(t)[0] == Approx(0.2 * (seconds(t) - 0.15)).margin(0.0002));
    }
  });
  CHECK(fed.robot.setpoint_taken() >= fed.sequence - 1);
}

TEST_CASE("a step is taken within the limits of every motor, and without overshoot") {
  Fed fed;
  Joints goal = fed.home;
  goal[0] += 2;
  goal[1] += 0.5;
  goal[2] += 1.4;  // and so J2 + J3, which its motor turns, by 1.9
  const auto kinematics = ArmKinematics::load("config/arms/m710ic_50.yaml");
  const double dt = 0.008;
  Joints speed{};
  Joints last = kinematics->motor_joints(fed.home);
  double fastest = 0;
  double hardest = 0;
  double farthest = 0;
  fed.feed(
      4 * second, [&](double) { return goal; },
      [&](Utime t) {
        if (t % (8 * millisecond) != 0) return;
        const Joints motors = kinematics->motor_joints(fed.robot.joints_at(t));
        for (std::size_t i = 0; i < 6; ++i) {
          const double v = (motors[i] - last[i]) / dt;
          const JointLimit& limit = kinematics->limits()[i];
          fastest = std::max(fastest, std::abs(v) / limit.speed);
          hardest = std::max(hardest, std::abs(v - speed[i]) / dt / limit.acceleration);
          speed[i] = v;
          last[i] = motors[i];
        }
        farthest = std::max(farthest, fed.robot.joints_at(t)[0] - goal[0]);
      });
  CHECK(fastest == Approx(1.0).margin(1e-6));  // the longest way is run at full speed
  CHECK(hardest == Approx(1.0).margin(1e-6));
  CHECK(farthest < 1e-9);
  for (std::size_t i = 0; i < 6; ++i) CHECK(fed.here()[i] == Approx(goal[i]).margin(1e-6));
}

TEST_CASE("a hold brings all axes to rest on the line they were on") {
  Fed fed;
  const auto path = [&](double t) {
    Joints joints = fed.home;
    joints[0] += 0.8 * t;
    joints[3] -= 0.4 * t;
    return joints;
  };
  fed.feed(second, path);
  fed.robot.hold();
  CHECK(fed.robot.state() == ControllerState::held);
  CHECK(fed.robot.program_state() == 1);
  const Joints at_hold = fed.here();
  fed.feed(2 * second, path, [&](Utime t) {
    const Joints j = fed.robot.joints_at(t);
    CHECK(j[3] == Approx(-0.5 * j[0]).margin(1e-9));
  });
  const Joints rest = fed.here();
  fed.feed(3 * second, path);
  CHECK(fed.here() == rest);
  const double braking = 0.8 * 0.8 / (2 * radians(350));
  CHECK(rest[0] - at_hold[0] == Approx(braking).margin(0.8 * 0.008));
}

TEST_CASE("the arm is held 150 ms after the last heartbeat of its host") {
  Fed fed;
  const auto path = [&](double t) {
    Joints joints = fed.home;
    joints[0] += 0.2 * t;
    return joints;
  };
  fed.feed(second, path);
  const Utime silence = fed.now;
  while (fed.robot.state() == ControllerState::running) {
    fed.now += millisecond;
    fed.robot.advance(fed.now);
  }
  CHECK(fed.now - silence > 134 * millisecond);
  CHECK(fed.now - silence < 160 * millisecond);
  CHECK(fed.robot.error() == robot_error::host_heartbeat);
  fed.robot.start(fed.now);  // not while the host is silent
  CHECK(fed.robot.state() == ControllerState::held);
  fed.robot.take_heartbeat(fed.now);
  fed.robot.start(fed.now);
  CHECK(fed.robot.state() == ControllerState::running);
}

TEST_CASE("an emergency stop brakes harder, and needs its chain closed, RESET and START") {
  Fed fed;
  const auto path = [&](double t) {
    Joints joints = fed.home;
    joints[0] += 0.8 * t;
    return joints;
  };
  fed.feed(second, path);
  const double before = fed.here()[0];
  fed.robot.set_safety(false, true);
  CHECK(fed.robot.state() == ControllerState::emergency_stop);
  fed.feed(2 * second, path);
  CHECK(fed.here()[0] - before < 0.8 * 0.8 / (4 * radians(350)) + 0.8 * 0.008);
  fed.robot.reset();
  CHECK(fed.robot.state() == ControllerState::emergency_stop);
  fed.robot.set_safety(true, true);
  CHECK(fed.robot.state() == ControllerState::fault);
  fed.robot.start(fed.now);
  CHECK(fed.robot.state() == ControllerState::fault);
  fed.robot.reset();
  CHECK(fed.robot.state() == ControllerState::idle);
  CHECK(fed.robot.error() == 0);
  fed.robot.start(fed.now);
  CHECK(fed.robot.state() == ControllerState::running);
}

TEST_CASE("a set-point beyond a limit faults the controller") {
  Fed fed;
  Joints beyond = fed.home;
  beyond[1] = 3;
  fed.feed(100 * millisecond, [&](double) { return beyond; });
  CHECK(fed.robot.state() == ControllerState::fault);
  CHECK(fed.robot.error() == robot_error::joint_limit);
}

TEST_CASE("late and early set-points do not make the motion uneven: their stamps count") {
  Fed fed;
  Random random(3, "jitter");
  double worst = 0;
  double last = 0;
  // Set-points of a steady ramp that reach the controller up to 12 ms late.
  std::vector<std::pair<Utime, int>> arrivals;
  for (int k = 0; k < 200; ++k) {
    arrivals.push_back({k * 16 * millisecond + static_cast<Utime>(random.uniform(0, 12000)), k});
  }
  std::size_t next = 0;
  for (Utime t = 0; t < 3 * second; t += millisecond) {
    fed.robot.advance(t);
    while (next < arrivals.size() && arrivals[next].first <= t) {
      Joints joints = fed.home;
      joints[0] = 0.2 * 0.016 * arrivals[next].second;
      fed.robot.take_heartbeat(t);
      fed.robot.take_setpoint(joints, ++fed.sequence, 16 * arrivals[next].second, t);
      ++next;
    }
    if (t % (8 * millisecond) != 0) continue;
    const double j = fed.robot.joints_at(t)[0];
    if (t > second) worst = std::max(worst, std::abs((j - last) / 0.008 - 0.2));
    last = j;
  }
  CHECK(worst < 0.02);
}

SimulatedRobot::Options position_register(int cnt) {
  SimulatedRobot::Options options;
  options.program = SimulatedRobot::Program::position_register;
  options.cnt = cnt;
  return options;
}

/// Of a ramp of J1, fed at 60 Hz: speeds of the 8 ms periods over 4 s, in parts of the ramp's.
struct Ramp {
  double mean = 0;
  double slowest = INFINITY;
  double fastest = 0;
  double hardest = 0;  // rad/s^2
  double max_lag = 0;  // s
  double min_lag = INFINITY;
  int stops = 0;  // periods at rest

  Ramp(double rate, const SimulatedRobot::Options& options) {
    Fed fed(options);
    double last = fed.home[0];
    double speed = 0;
    int n = 0;
    int k = 0;
    for (Utime t = 0; t <= 5 * second; t += 500) {
      fed.robot.advance(t);
      if (t >= k * 50 * millisecond / 3) {
        Joints joints = fed.home;
        joints[0] = rate * k / 60.0;
        fed.robot.take_heartbeat(t);
        fed.robot.take_setpoint(joints, ++fed.sequence, k * 50 / 3, t);
        ++k;
      }
      if (t % (8 * millisecond) != 0) continue;
      const double j = fed.robot.joints_at(t)[0];
      const double v = (j - last) / 0.008;
      if (t > second) {
        mean += v / rate;
        ++n;
        slowest = std::min(slowest, v / rate);
        fastest = std::max(fastest, v / rate);
        hardest = std::max(hardest, std::abs(v - speed) / 0.008);
        stops += v < 1e-9 ? 1 : 0;
        const double lag = seconds(t) - j / rate;
        max_lag = std::max(max_lag, lag);
        min_lag = std::min(min_lag, lag);
      }
      speed = v;
      last = j;
    }
    mean /= n;
  }
};

TEST_CASE("a position-register program follows a ramp at its mean speed, unevenly") {
  const double a = radians(350);
  const Ramp even(0.02, SimulatedRobot::Options{});
  CHECK(even.slowest > 0.9);
  CHECK(even.fastest < 1.1);
  // Slowly: each motion is over before the next point comes, and the robot waits for it. At 2
  // mrad/s a motion takes one period (its triangle 4.7 ms), at 20 mrad/s two; a point comes
  // every 2.08.
  const double periods = 1e3 / 60 / 8;
  const Ramp slow(0.002, position_register(100));
  CAPTURE(slow.slowest, slow.fastest, slow.min_lag, slow.max_lag, slow.stops);
  CHECK(slow.mean == Approx(1).epsilon(0.01));
  CHECK(slow.stops == Approx(500 * (1 - 1 / periods)).margin(4));
  CHECK(slow.fastest == Approx(periods).epsilon(0.01));
  const Ramp steady(0.02, position_register(100));
  CAPTURE(steady.slowest, steady.fastest, steady.min_lag, steady.max_lag, steady.stops);
  CHECK(steady.mean == Approx(1).epsilon(0.01));
  CHECK(steady.stops == Approx(500 * (1 - 2 / periods)).margin(2));
  CHECK(steady.fastest > 1.2);
  CHECK(steady.hardest < 2 * a);  // two motions blend, each within the limit
  // Behind by the dead time and the motion, and until the next one by a set-point's period and by
  // one of the controller's.
  const double motion = 2 * std::sqrt(0.02 / 60 / a);
  CHECK(steady.min_lag > 0.15);
  CHECK(steady.max_lag < 0.15 + 1 / 60.0 + 0.008 + motion);
  // Fast: points are passed over while a motion gathers speed, and motions blend.
  const Ramp fast(0.2, position_register(100));
  CAPTURE(fast.slowest, fast.fastest, fast.hardest, fast.min_lag, fast.max_lag, fast.stops);
  CHECK(fast.mean == Approx(1).epsilon(0.01));
  CHECK(fast.stops == 0);
  CHECK(fast.slowest < 0.9);
  CHECK(fast.fastest > 1.1);
  CHECK(fast.hardest < 2 * a);
  CHECK(fast.min_lag > 0.15);
  // Without blending it comes to rest at every point that it takes, and falls farther behind.
  const Ramp fine(0.2, position_register(0));
  CHECK(fine.mean == Approx(1).epsilon(0.02));
  CHECK(fine.slowest < a * 0.004 / 0.2);  // the mean of a period that has the rest within
  CHECK(fine.min_lag > fast.max_lag);
}

TEST_CASE("a position-register program takes one point within the limits, and rests there") {
  Fed fed(position_register(100));
  Joints goal = fed.home;
  goal[0] += 2;
  goal[3] -= 0.5;
  double last = fed.home[0];
  double fastest = 0;
  fed.feed(
      3 * second, [&](double) { return goal; },
      [&](Utime t) {
        const Joints j = fed.robot.joints_at(t);
        CHECK(j[3] == Approx(-0.25 * j[0]).margin(1e-9));  // in proportion
        if (t % (8 * millisecond) != 0) return;
        fastest = std::max(fastest, (j[0] - last) / 0.008);
        last = j[0];
        REQUIRE(j[0] < goal[0] + 1e-9);
      });
  CHECK(fastest == Approx(radians(175)).epsilon(0.01));
  for (std::size_t i = 0; i < 6; ++i) CHECK(fed.here()[i] == Approx(goal[i]).margin(1e-9));
}

TEST_CASE("a hold and a new start leave a position-register program where the arm stands") {
  Fed fed(position_register(100));
  const auto path = [&](double t) {
    Joints joints = fed.home;
    joints[0] += 0.4 * t;
    return joints;
  };
  fed.feed(second, path);
  fed.robot.hold();
  fed.feed(2 * second, path);
  const Joints rest = fed.here();
  fed.robot.start(fed.now);
  REQUIRE(fed.robot.state() == ControllerState::running);
  fed.feed(3 * second, [&](double) { return rest; });
  CHECK(fed.here()[0] == Approx(rest[0]).margin(1e-9));
  fed.robot.set_override(0);  // no motion begins, none is lost
  fed.feed(4 * second, [&](double) { return fed.home; });
  CHECK(fed.here()[0] == Approx(rest[0]).margin(1e-9));
  fed.robot.set_override(1);
  fed.feed(6 * second, [&](double) { return fed.home; });
  CHECK(fed.here()[0] == Approx(fed.home[0]).margin(1e-9));
}

}  // namespace
}  // namespace berth
