// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety/arm_watch.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/bus/loop.h"
#include "test/catch.h"

namespace berth::testbed {
namespace {

/// An arm whose controller plays set-points of 60 Hz out a dead time late and reports at 125 Hz.
struct Follower {
  explicit Follower(double max_speed) : speed(max_speed) {
    watch.begin();
    for (Utime t = start; t < start + second; t += step) tick(t);  // at rest first
  }

  /// Joints commanded at t: all but the last swing, each in its own time, none faster than `speed`.
  Joints commanded(Utime t) const {
    Joints joints{};
    const double s = phase_at(t);
    for (std::size_t i = 0; i < 5; ++i) {
      const double rate = 0.5 + 0.15 * static_cast<double>(i);
      joints[i] = speed / rate * (1 - std::cos(rate * s));
    }
    return joints;
  }

  /// How long the motion has gone on, s: it stops and starts within half a second.
  double phase_at(Utime t) const {
    const Utime at = std::max<Utime>(0, t - start) / step;
    return at < Utime(phases.size()) ? phases[static_cast<std::size_t>(at)] : phases.back();
  }

  std::optional<Contradiction> tick(Utime t) {
    now = t;
    const double change = 2 * seconds(step);
    pace += std::clamp((t < start + second || rests ? 0.0 : 1.0) - pace, -change, change);
    phases.push_back((phases.empty() ? 0 : phases.back()) + pace * seconds(step));
    dead_time += static_cast<Utime>(std::llround(dead_time_rate * static_cast<double>(step)));
    if (t % 16000 < step) commands.add(t, {commanded(t), {}});
    if (t % 8000 >= step) return std::nullopt;
    Joints reported = commanded(t - dead_time);
    reported[0] += astray;
    return watch.check(t, 0.001, reported, commands);
  }

  /// @return what is seen first, within `s` seconds; meanwhile joint 1 drifts at `drift`, rad/s.
  std::optional<Contradiction> go(double s, double drift = 0) {
    for (const Utime end = now + utime_from_seconds(s); now < end;) {
      astray += drift * seconds(step);
      if (auto seen = tick(now + step)) return seen;
    }
    return std::nullopt;
  }

  static constexpr Utime step = 1 * millisecond;
  static constexpr Utime start = 1000 * second;
  Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  FollowingWatch watch{ArmRole::replica, *cell.replica.kinematics, {}};
  JointHistory commands;
  double speed;
  Utime dead_time = 150 * millisecond;
  double astray = 0;
  bool rests = false;
  double dead_time_rate = 0;  // by which the dead time grows, s a second
  double pace = 0;
  std::vector<double> phases;  // one a step
  Utime now = start;
};

TEST_CASE("an arm that follows passes whatever its controller's dead time, which is estimated") {
  const Utime dead_time = GENERATE(20, 150, 400) * millisecond;
  const double speed = radians(GENERATE(1.0, 10.0, 40.0));
  INFO(dead_time << " us, " << degrees(speed) << " deg/s");
  Follower arm(speed);
  arm.dead_time = dead_time;
  const auto seen = arm.go(5);
  INFO((seen ? seen->text : ""));
  CHECK_FALSE(seen);
  const auto& found = arm.watch.dead_time();
  CHECK(std::abs(found.best - dead_time) <= 10000);  // set-points, reports and delays have steps
  CHECK(found.min <= dead_time);
  CHECK(found.max >= dead_time);
  if (speed < radians(5)) return;
  CHECK(found.max - found.min <= 30000);
  CHECK(std::abs(found.best - dead_time) <= 2000);
}

TEST_CASE("drift is seen at about the limit, at rest, at speed and before the delay is known") {
  const double speed = radians(GENERATE(0.0, 2.0, 10.0, 40.0));
  const double warm_up = GENERATE(0.0, 0.5, 5.0);
  const double drift = radians(GENERATE(-5.0, -1.0, 1.0, 5.0));
  Follower arm(speed);
  REQUIRE_FALSE(arm.go(warm_up));
  const auto seen = arm.go(10, drift);
  INFO(degrees(speed) << " deg/s for " << warm_up << " s, drift " << degrees(drift) << " deg/s, "
                      << degrees(arm.astray) << " deg astray");
  REQUIRE(seen);
  CHECK(seen->code == "arm-strays");
  CHECK(std::abs(degrees(arm.astray)) > 0.95);
  CHECK(std::abs(degrees(arm.astray)) < (warm_up >= 5 ? 1.5 : 2.5));
}

TEST_CASE("a dead time that grows in the midst of a motion is not following") {
  Follower arm(radians(20));
  REQUIRE_FALSE(arm.go(4));
  arm.dead_time += 200 * millisecond;
  const auto seen = arm.go(2);
  REQUIRE(seen);
  CHECK(seen->code == "arm-strays");
  // after another start it is what it is
  arm.watch.begin();
  CHECK_FALSE(arm.go(4));
  CHECK(std::abs(arm.watch.dead_time().best - arm.dead_time) <= 10000);
}

TEST_CASE("a dead time that changes over seconds, or at rest, is followed") {
  Follower arm(radians(20));
  REQUIRE_FALSE(arm.go(20));
  SECTION("as a controller comes under load: within ten seconds, and back") {
    for (const double rate : {0.015, -0.015}) {
      arm.dead_time_rate = rate;
      const auto seen = arm.go(10);
      INFO((seen ? seen->text : "") << ", dead time " << arm.dead_time << " us");
      CHECK_FALSE(seen);
      CHECK(std::abs(arm.watch.dead_time().best - arm.dead_time) <= 30000);
    }
    CHECK(std::abs(arm.dead_time - 150 * millisecond) < 1000);
  }
  SECTION("while the arm rests") {
    arm.rests = true;
    REQUIRE_FALSE(arm.go(5));
    arm.dead_time = GENERATE(60, 240) * millisecond;
    arm.rests = false;
    const auto seen = arm.go(5);
    INFO((seen ? seen->text : ""));
    CHECK_FALSE(seen);
    CHECK(std::abs(arm.watch.dead_time().best - arm.dead_time) <= 5000);
    CHECK(arm.watch.dead_time().max - arm.watch.dead_time().min <= 30000);
  }
  // What has changed excuses nothing: an arm that strays is seen as before.
  REQUIRE_FALSE(arm.go(3));
  arm.dead_time_rate = 0;
  CHECK(arm.go(10, radians(1)));
  CHECK(std::abs(degrees(arm.astray)) < 1.5);
}

}  // namespace
}  // namespace berth::testbed
