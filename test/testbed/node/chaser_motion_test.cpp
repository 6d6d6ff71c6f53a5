// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/node/chaser_motion.h"

#include <cmath>
#include <vector>

#include "test/catch.h"

namespace berth::testbed {
namespace {

constexpr std::int64_t step = 16667;  // us

/// T_N_sensor: speeds up along x as it turns about a tilted axis.
Pose sensor_at(double t) {
  return {Vector3d(0.01 * t * t, 0.02 * std::sin(t), -4),
          rotation_from_vector(Vector3d(0.01, 0.03, 0.02) * t * t)};
}

std::vector<inertial_motion_t> published(ChaserMotion& motion, std::int64_t from,
                                         std::int64_t until) {
  std::vector<inertial_motion_t> messages;
  for (std::int64_t t = from; t < until; t += step) {
    const auto message = motion.add(t, sensor_at(1e-6 * static_cast<double>(t)).inverse());
    if (message) messages.push_back(*message);
  }
  return messages;
}

/// In the outer frame, at a time.
Velocity velocity_at(std::int64_t utime) {
  const double t = 1e-6 * static_cast<double>(utime);
  return velocity_between(sensor_at(t - 1e-4), sensor_at(t + 1e-4), 2e-4);
}

TEST_CASE("the commanded motion is published as the chaser's instruments would measure it") {
  ChaserMotion motion;
  const auto messages = published(motion, 1000000, 3000000);
  REQUIRE(messages.size() > 20);
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const inertial_motion_t& m = messages[i];
    if (i > 0) CHECK(m.utime - m.interval_us == messages[i - 1].utime);
    const Quaterniond& attitude = sensor_at(1e-6 * static_cast<double>(m.utime)).rotation;
    const Velocity before = velocity_at(m.utime - m.interval_us);
    const Velocity after = velocity_at(m.utime);
    const Vector3d change = attitude * Vector3d::Map(m.velocity_change_m_s);
    CHECK((change - (after.linear - before.linear)).norm() < 2e-5);
    const Vector3d turning = attitude * Vector3d::Map(m.angular_velocity_rad_s);
    CHECK((turning - after.angular).norm() < 2e-5);
    CHECK(m.velocity_change_sigma_m_s > 0);
    sum += change;
  }
  const Vector3d in_all = velocity_at(messages.back().utime).linear -
                          velocity_at(messages.front().utime - messages.front().interval_us).linear;
  CHECK((sum - in_all).norm() < 1e-4);
}

TEST_CASE("nothing is published across a gap between set-points") {
  ChaserMotion motion;
  const std::int64_t last = published(motion, 1000000, 2000000).back().utime;
  const auto messages = published(motion, 2500000, 3000000);
  REQUIRE(!messages.empty());
  CHECK(last < 2000000);
  CHECK(messages.front().utime - messages.front().interval_us > 2500000);
}

}  // namespace
}  // namespace berth::testbed
