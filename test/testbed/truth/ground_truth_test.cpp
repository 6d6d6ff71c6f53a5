// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/truth/ground_truth.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/core/random.h"
#include "test/catch.h"

namespace berth::testbed {
namespace {

const Cell& range_cell() {
  static const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  return cell;
}

/// A cell without uncertainty.
const Calibration& certain() {
  static const Calibration calibration;
  return calibration;
}

/// Both arms move at constant joint rates, so that linear interpolation is exact.
ArmPair joints_at(std::int64_t utime) {
  ArmPair pair{range_cell().replica.home, range_cell().sensor.home};
  const double t = static_cast<double>(utime) * 1e-6;
  for (std::size_t i = 0; i < 6; ++i) {
    pair.replica[i] += 0.02 * static_cast<double>(i + 1) * t;
    pair.sensor[i] -= 0.015 * static_cast<double>(i + 1) * t;
  }
  return pair;
}

JointSample sample_at(ArmRole role, std::int64_t utime) {
  JointSample sample;
  sample.utime = utime;
  sample.joints = joints_at(utime).of(role);
  sample.sigma.fill(1e-5);
  return sample;
}

TEST_CASE("truth is exact between samples however they come, and never ahead of either arm") {
  Random random(1, "sample times");
  for (int trial = 0; trial < 20; ++trial) {
    std::int64_t last[2] = {0, 0};
    std::int64_t newest = -1;
    int published = 0;
    GroundTruth truth(range_cell(), certain(), {}, [&](const Truth& t) {
      ++published;
      CHECK(t.utime % 8000 == 0);
      CHECK(t.utime <= std::min(last[0], last[1]));
      CHECK(t.utime > newest);
      newest = t.utime;
      const ArmPair joints = joints_at(t.utime);
      const Pose expected = range_cell().relative_pose(joints.replica, joints.sensor);
      CHECK(distance(t.pose, expected) < 1e-9);
      CHECK(angle_between(t.pose, expected) < 1e-9);
    });
    for (int n = 0; n < 200; ++n) {
      const int arm = random.uniform() < 0.5 ? 0 : 1;
      last[arm] += static_cast<std::int64_t>(random.uniform(2000, 25000));
      truth.add(both_arms[arm], sample_at(both_arms[arm], last[arm]));
    }
    CHECK(published > 50);
  }
}

TEST_CASE("a gap in one arm's samples is not bridged") {
  std::vector<std::int64_t> times;
  GroundTruth truth(range_cell(), certain(), {}, [&](const Truth& t) { times.push_back(t.utime); });
  for (std::int64_t t = 0; t <= 1000000; t += 10000) {
    truth.add(ArmRole::replica, sample_at(ArmRole::replica, t));
    if (t <= 400000 || t >= 600000) truth.add(ArmRole::sensor, sample_at(ArmRole::sensor, t));
  }
  for (const std::int64_t t : times) CHECK((t <= 400000 || t >= 600000));
  CHECK(times.back() == 1000000);
  CHECK(truth.skipped() == 24);
}

TEST_CASE("samples out of order or repeated change nothing") {
  int published = 0;
  GroundTruth truth(range_cell(), certain(), {}, [&](const Truth&) { ++published; });
  for (std::int64_t t = 0; t <= 100000; t += 10000) {
    for (const ArmRole role : both_arms) {
      truth.add(role, sample_at(role, t));
      truth.add(role, sample_at(role, t));
      truth.add(role, sample_at(role, t - 5000));
    }
  }
  CHECK(published == 13);  // 0, 8, ... 96 ms
}

TEST_CASE("velocity is that of the relative pose") {
  Truth last;
  GroundTruth truth(range_cell(), certain(), {}, [&](const Truth& t) { last = t; });
  for (std::int64_t t = 0; t <= 500000; t += 10000) {
    for (const ArmRole role : both_arms) truth.add(role, sample_at(role, t));
  }
  const auto pose = [](std::int64_t t) {
    const ArmPair joints = joints_at(t);
    return range_cell().relative_pose(joints.replica, joints.sensor);
  };
  const Velocity expected =
      velocity_between(pose(last.utime - 33000), pose(last.utime - 31000), 0.002);
  CHECK((last.velocity.linear - expected.linear).norm() < 0.02 * expected.linear.norm());
  CHECK((last.velocity.angular - expected.angular).norm() < 0.02 * expected.angular.norm());
}

TEST_CASE("the readings' covariance is what random errors of joints and times make of the pose") {
  ArmMoment replica;
  ArmMoment sensor;
  const ArmPair joints = joints_at(300000);
  replica.joints = joints.replica;
  sensor.joints = joints.sensor;
  for (std::size_t i = 0; i < 6; ++i) {
    replica.sigma[i] = 1e-4 * static_cast<double>(i + 1);
    sensor.sigma[i] = 2e-4;
    replica.rate[i] = 0.1 * std::cos(static_cast<double>(i));
    sensor.rate[i] = -0.2;
  }
  replica.time_sigma = 2e-3;
  sensor.time_sigma = 1e-3;
  const Matrix6d covariance =
      reading_covariance(relative_jacobian(range_cell(), joints), replica, sensor);
  Random random(2, "joint errors");
  const Pose mean = range_cell().relative_pose(joints.replica, joints.sensor);
  Matrix6d sum = Matrix6d::Zero();
  constexpr int trials = 20000;
  const auto drawn = [&](const ArmMoment& arm) {
    Joints q = arm.joints;
    const double late = random.normal(arm.time_sigma);
    for (std::size_t i = 0; i < 6; ++i) q[i] += random.normal(arm.sigma[i]) + late * arm.rate[i];
    return q;
  };
  for (int n = 0; n < trials; ++n) {
    const Joints q = drawn(replica);
    const Vector6d d = difference(mean, range_cell().relative_pose(q, drawn(sensor)));
    sum += d * d.transpose();
  }
  sum /= trials;
  // every direction within the sampling error of so many trials
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(covariance);
  CHECK(solver.eigenvalues().minCoeff() > 0);
  const Matrix6d root = solver.operatorInverseSqrt();
  CHECK((root * sum * root - Matrix6d::Identity()).cwiseAbs().maxCoeff() < 0.06);
}

TEST_CASE("what a straight line between readings misses is in truth's covariance") {
  // Joint 1 of the replica arm speeds up; everything else is known well.
  constexpr double acceleration = 2;  // rad/s^2
  const auto turned = [&](std::int64_t utime) {
    const double t = 1e-6 * static_cast<double>(utime);
    Joints joints = range_cell().replica.home;
    joints[0] += 0.5 * acceleration * t * t;
    return joints;
  };
  int between = 0;
  GroundTruth truth(range_cell(), certain(), {}, [&](const Truth& t) {
    if (t.utime < 100000) return;  // the first readings show no acceleration yet
    const Pose right = range_cell().relative_pose(turned(t.utime), range_cell().sensor.home);
    const double error = distance(right, t.pose);
    const double sigma = std::sqrt(t.covariance.topLeftCorner<3, 3>().trace());
    CHECK(sigma == Approx(error).epsilon(0.02).margin(1e-8));
    if (error > 1e-4) ++between;
  });
  for (std::int64_t t = 0; t <= 500000; t += 50000) {
    for (const ArmRole role : both_arms) {
      JointSample sample;
      sample.utime = t;
      sample.joints = role == ArmRole::replica ? turned(t) : range_cell().sensor.home;
      truth.add(role, sample);
    }
  }
  CHECK(between > 20);
}

}  // namespace
}  // namespace berth::testbed
