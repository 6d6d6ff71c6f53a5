// SPDX-License-Identifier: BSD-3-Clause
// The Kalman filter on SO(3) x R3: its covariance is consistent.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>
#include <map>
#include <memory>

#include "common/core/random.h"
#include "estimator/filter/pose_filter.h"
#include "estimator/published/alpha_beta_tracker.h"
#include "test/catch.h"
#include "test/estimator/filter/noisy_poses.h"

using namespace berth;
using namespace berth::estimator;

namespace {

const Pose start_pose = pose_from_xyzwpr({100, -100, 5000, 10, 20, 30});
const Velocity start_velocity{{0.01, -0.02, -0.03}, {0.02, 0.01, -0.05}};

Matrix6d speed_variance(double linear, double angular) {
  Vector6d v;
  v << Vector3d::Constant(linear * linear), Vector3d::Constant(angular * angular);
  return v.asDiagonal();
}

Vector12d error_of(const PoseFilter& filter, const Pose& pose, const Velocity& v) {
  Vector12d e;
  e << difference(filter.pose(), pose), v.linear - filter.velocity().linear,
      v.angular - filter.velocity().angular;
  return e;
}

/// Information on the motion from noisy sightings of body-fixed points, each at its own time.
struct Sightings {
  std::vector<Vector3d> body;
  std::vector<Vector3d> seen;
  std::vector<double> late;  // s after the reference time
  double sigma = 0.005;

  MotionInformation about(const Motion& motion) const {
    MotionInformation result;
    for (std::size_t i = 0; i < body.size(); ++i) {
      const Pose then = moved(motion.pose, motion.velocity, late[i]);
      const Vector3d arm = then.rotation * body[i];
      Eigen::Matrix<double, 3, 12> j;
      j << Matrix3d::Identity(), -skew(arm), late[i] * Matrix3d::Identity(), -late[i] * skew(arm);
      const double weight = 1 / (sigma * sigma);
      result.information += weight * j.transpose() * j;
      result.gradient += weight * j.transpose() * (seen[i] - then * body[i]);
      ++result.returns;
    }
    return result;
  }
};

Sightings sightings(const Pose& pose, const Velocity& v, int count, Random& random) {
  Sightings s;
  for (int i = 0; i < count; ++i) {
    s.body.push_back(random.normal_vector(1));
    s.late.push_back(random.uniform(-0.25, 0.25));
    s.seen.push_back(moved(pose, v, s.late.back()) * s.body.back() + random.normal_vector(s.sigma));
  }
  return s;
}

/// What a batch measures of pose and velocity, linearised about some motion near the truth.
bool take(PoseFilter& filter, const Sightings& batch, const Motion& about, std::int64_t utime) {
  const MotionInformation measurement = batch.about(about);
  return filter.update(about.pose, noise(), {about, measurement}, utime);
}

}  // namespace

TEST_CASE("On a straight line the filter is the least-squares line through the measurements") {
  PoseFilterOptions options;
  options.linear_acceleration = options.angular_acceleration = 1e-7;
  PoseFilter filter(options);
  Random random(3, "line");
  // Two unknowns and n measurements of each coordinate.
  constexpr int n = 12;
  constexpr double step = 0.5;
  Eigen::Matrix<double, n, 2> a;
  Eigen::Matrix<double, n, 3> z;
  for (int i = 0; i < n; ++i) {
    const Pose truth = moved(start_pose, {start_velocity.linear, Vector3d::Zero()}, step * i);
    const Pose seen{truth.position + random.normal_vector(sigma_m), truth.rotation};
    a.row(i) << 1, step * (i - n + 1);
    z.row(i) = seen.position.transpose();
    if (i == 0) {
      filter.start(seen, noise(), 0, {}, speed_variance(100, 100));
    } else {
      REQUIRE(filter.update(seen, noise(), static_cast<std::int64_t>(1e6 * step * i)));
    }
  }
  const Eigen::Matrix2d normal = a.transpose() * a;
  const Eigen::Matrix<double, 2, 3> line = normal.ldlt().solve(a.transpose() * z);
  CHECK((filter.pose().position - line.row(0).transpose()).norm() < 1e-6);
  CHECK((filter.velocity().linear - line.row(1).transpose()).norm() < 1e-6);
  const Eigen::Matrix2d covariance = sigma_m * sigma_m * normal.inverse();
  CHECK(filter.covariance()(0, 0) == Approx(covariance(0, 0)).epsilon(1e-3));
  CHECK(filter.velocity_covariance()(2, 2) == Approx(covariance(1, 1)).epsilon(1e-3));
}

TEST_CASE("Errors are consistent with the covariance, at rest, in motion and manoeuvring") {
  const double acceleration = GENERATE(0.0, 0.02);
  PoseFilterOptions options;
  options.linear_acceleration = options.angular_acceleration = std::max(acceleration, 1e-6);
  double nees = 0;
  double min_eigenvalue = 1;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    Random random(seed, "filter");
    PoseFilter filter(options);
    Pose truth = start_pose;
    Velocity v = start_velocity;
    v.linear += random.normal_vector(0.05);
    v.angular += random.normal_vector(0.05);
    filter.start(measured(truth, random), noise(), 0, start_velocity, speed_variance(0.05, 0.05));
    for (int i = 1; i <= 20; ++i) {
      constexpr int pieces = 20;  // of white acceleration between measurements
      constexpr double dt = 0.5 / pieces;
      for (int k = 0; k < pieces; ++k) {
        truth = moved(truth, v, dt);
        v.linear += random.normal_vector(acceleration * std::sqrt(dt));
        v.angular += random.normal_vector(acceleration * std::sqrt(dt));
      }
      REQUIRE(filter.update(measured(truth, random), noise(), i * 500000));
    }
    const Matrix12d& p = filter.full_covariance();
    const Vector12d e = error_of(filter, truth, v);
    nees += e.dot(p.ldlt().solve(e)) / 12;
    ++count;
    CHECK((p - p.transpose()).norm() == 0);
    const Vector12d scale = p.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix12d correlation = scale.asDiagonal() * p * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Matrix12d> eigen(correlation, Eigen::EigenvaluesOnly);
    min_eigenvalue = std::min(min_eigenvalue, eigen.eigenvalues()[0]);
  }
  CHECK(min_eigenvalue > 0);
  // 1,800 degrees of freedom: one part in 30 is one sigma.
  CHECK(nees / count == Approx(1).margin(0.14));
}

TEST_CASE("Returns at their own times determine pose and velocity together, with covariance") {
  double nees = 0;
  constexpr int trials = 150;
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    Random random(seed, "returns");
    Velocity v = start_velocity;
    v.linear += random.normal_vector(0.05);
    v.angular += random.normal_vector(0.05);
    PoseFilterOptions options;
    options.linear_acceleration = options.angular_acceleration = 1e-6;
    PoseFilter filter(options);
    filter.start(measured(start_pose, random), noise(), 0, start_velocity,
                 speed_variance(0.05, 0.05));
    Pose truth = start_pose;
    for (int i = 1; i <= 4; ++i) {
      truth = moved(start_pose, v, 0.5 * i);
      const Sightings batch = sightings(truth, v, 50, random);
      CHECK(take(filter, batch, {truth, v}, i * 500000));
    }
    const Vector12d e = error_of(filter, truth, v);
    nees += e.dot(filter.full_covariance().ldlt().solve(e)) / 12;
  }
  CHECK(nees / trials == Approx(1).margin(0.14));
}

TEST_CASE("The order in which a scan's returns are taken in does not matter") {
  Random random(4, "split");
  PoseFilterOptions options;
  options.linear_acceleration = options.angular_acceleration = 1e-7;
  PoseFilter whole(options);
  whole.start(start_pose, noise(), 0);
  PoseFilter parts = whole;
  const Pose truth = moved(start_pose, start_velocity, 0.5);
  const Sightings batch = sightings(truth, start_velocity, 60, random);
  CHECK(take(whole, batch, {truth, start_velocity}, 500000));
  for (std::size_t k = 0; k < 6; ++k) {
    Sightings part;
    for (std::size_t i = k; i < batch.body.size(); i += 6) {
      part.body.push_back(batch.body[i]);
      part.seen.push_back(batch.seen[i]);
      part.late.push_back(batch.late[i]);
    }
    CHECK(take(parts, part, {truth, start_velocity}, 500000));
  }
  CHECK(distance(whole.pose(), parts.pose()) < 1e-5);
  CHECK(angle_between(whole.pose(), parts.pose()) < 1e-5);
  CHECK(whole.full_covariance().isApprox(parts.full_covariance(), 1e-3));
}

TEST_CASE("Where a measurement of pose and velocity is linearised does not matter") {
  Random random(5, "measured");
  PoseFilter one({});
  one.start(start_pose, noise(), 0);
  PoseFilter other = one;
  const Pose truth = moved(start_pose, start_velocity, 0.5);
  const Sightings batch = sightings(truth, start_velocity, 60, random);
  CHECK(take(one, batch, {truth, start_velocity}, 500000));
  CHECK(take(other, batch, {perturbed(truth, Vector6d::Constant(1e-3)), {}}, 500000));
  CHECK(distance(one.pose(), other.pose()) < 1e-5);
  CHECK((one.velocity().angular - other.velocity().angular).norm() < 1e-4);
  CHECK(one.full_covariance().isApprox(other.full_covariance(), 1e-2));
}

TEST_CASE("What is off in every scan alike is averaged away by none of them") {
  // Each scan shows the target shifted by the same unknown c, and adds noise of its own.
  constexpr double noise_sigma = 0.002;
  Vector6d shift_sigma;
  shift_sigma << 0.003, 0.001, 0.005, 0.0005, 0.002, 0.001;
  PoseFilterOptions options;
  options.linear_acceleration = options.angular_acceleration = 1e-3;
  constexpr int runs = 200;
  std::map<int, double> nees;
  for (int run = 0; run < runs; ++run) {
    Random random(run, "shifted");
    Vector6d shift;
    for (int i = 0; i < 6; ++i) shift[i] = shift_sigma[i] * random.normal();
    PoseFilter filter(options);
    Vector6d wrong;
    for (int i = 0; i < 6; ++i) wrong[i] = 0.02 * random.normal();
    filter.start(perturbed(start_pose, wrong), 4e-4 * Matrix6d::Identity(), 0, {},
                 1e-8 * Matrix6d::Identity());
    for (int scan = 1; scan <= 100; ++scan) {
      Vector6d seen = shift;
      for (int i = 0; i < 6; ++i) seen[i] += noise_sigma * random.normal();
      const Matrix6d c = shift_sigma.cwiseAbs2().asDiagonal();
      const Matrix6d covariance = c + noise_sigma * noise_sigma * Matrix6d::Identity();
      MeasuredMotion measured;
      measured.reference = {perturbed(start_pose, seen), {}};
      const Matrix6d information = covariance.inverse();
      measured.measurement.information.topLeftCorner<6, 6>() = information;
      measured.systematic.topLeftCorner<6, 6>() = information * c * information;
      REQUIRE(filter.update(measured.reference.pose, covariance, measured, 500000 * scan));
      if (scan != 1 && scan != 10 && scan != 100) continue;
      const Vector6d error = difference(filter.pose(), start_pose);
      nees[scan] += error.dot(filter.covariance().ldlt().solve(error)) / runs;
    }
    for (int i = 0; i < 6; ++i) {
      CHECK(std::sqrt(filter.covariance()(i, i)) > 0.9 * std::min(0.02, shift_sigma[i]));
      CHECK(std::sqrt(filter.covariance()(i, i)) < shift_sigma[i] + noise_sigma);
    }
  }
  for (const auto& [scans, mean] : nees) {
    CAPTURE(scans);
    CHECK(mean > 5);  // 6 expected; 200 draws: 0.25, 1 sigma
    CHECK(mean < 7);
  }
}

TEST_CASE("A shift that all scans have in common is another as the target turns") {
  // Seen from all round, the shifts' mean is known better than any of them.
  const auto sigma_with = [](double rate) {
    const Velocity turning{Vector3d::Zero(), {0, rate, 0}};
    PoseFilterOptions options;
    options.linear_acceleration = options.angular_acceleration = 1e-6;
    PoseFilter filter(options);
    filter.start(start_pose, 1e-2 * Matrix6d::Identity(), 0, turning, 1e-12 * Matrix6d::Identity());
    MeasuredMotion measured;
    measured.measurement.information.topLeftCorner<6, 6>() = 1e6 * Matrix6d::Identity();
    measured.systematic.topLeftCorner<6, 6>() = 0.9e6 * Matrix6d::Identity();
    for (int scan = 1; scan <= 20; ++scan) {
      measured.reference = {moved(start_pose, turning, 0.1 * scan), turning};
      REQUIRE(filter.update(measured.reference.pose, 1e-6 * Matrix6d::Identity(), measured,
                            100000 * scan));
    }
    return std::sqrt(filter.covariance()(0, 0));
  };
  CHECK(sigma_with(0) > 0.94e-3);
  CHECK(sigma_with(0) < 1e-3);
  CHECK(sigma_with(radians(90)) < 0.9 * sigma_with(0));
}

TEST_CASE("A measurement of an earlier time corrects the pose of now") {
  PoseFilter filter({});
  filter.start(start_pose, noise(), 0, start_velocity, speed_variance(1e-4, 1e-4));
  CHECK(filter.update(moved(start_pose, start_velocity, 1), noise(), 1000000));
  CHECK(filter.update(moved(start_pose, start_velocity, 0.5), noise(), 500000));
  CHECK(filter.utime() == 1000000);
  CHECK(distance(filter.pose(), moved(start_pose, start_velocity, 1)) < 1e-4);
}

TEST_CASE("A turning target is followed across every angle") {
  PoseFilter filter({});
  const Velocity spin{{0, 0, 0}, {0.03, 0.1, 0}};
  filter.start(start_pose, noise(), 0);
  for (int i = 1; i <= 140; ++i) {
    const Pose truth = moved(start_pose, spin, 0.5 * i);
    REQUIRE(filter.update(truth, noise(), i * 500000));
    if (i > 3) REQUIRE(angle_between(filter.pose(), truth) < 2e-3);
  }
}

TEST_CASE("The chaser's measured own motion is not attributed to the target") {
  PoseFilter informed({});
  informed.start(start_pose, noise(), 0, start_velocity, speed_variance(0.001, 0.001));
  PoseFilter uninformed = informed;
  // In a second the sensor gets faster by 0.1 m/s, then goes on so.
  const Vector3d none = Vector3d::Zero();
  const SensorMotion burn{0, 1000000, Vector3d(0.1, 0, 0.05), none, none, 0.001, 0};
  SensorMotions motions;
  motions.add(burn);
  CHECK(motions.propagate(informed, 2000000) == Approx(1));
  const Pose straight = moved(start_pose, start_velocity, 2);
  const Pose truth{straight.position - 1.5 * burn.acceleration, straight.rotation};
  CHECK(distance(informed.predict(2000000), truth) < 1e-9);
  CHECK(distance(uninformed.predict(2000000), truth) > 0.15);
  CHECK(informed.predicted_covariance(2000000)(0, 0) >
        uninformed.predicted_covariance(2000000)(0, 0));
}

TEST_CASE("A target at rest is predicted from a sensor that turns and accelerates") {
  const Pose target = pose_from_xyzwpr({200, -100, 6000, 10, 20, 30});
  // T_world_sensor: about a point next to the sensor, faster and faster.
  const Vector3d axis = Vector3d(0.3, 1, -0.2).normalized();
  const auto sensor = [&](double t) {
    const double angle = 0.03 * t + 0.02 * t * t;
    const Pose turn{Vector3d::Zero(), rotation_from_vector(angle * axis)};
    return turn * Pose{Vector3d(0.5, -0.3, 0.8), Quaterniond::Identity()};
  };
  const auto seen = [&](double t) { return sensor(t).inverse() * target; };
  const auto rate = [&](const Pose& at, double angular) -> Velocity {
    const Vector3d w = angular * axis;
    return {w.cross(at.position), w};
  };
  const Velocity first = rate(sensor(0), 0.03);
  const Pose start = seen(0);
  PoseFilter filter({});
  // The target stands: it seems to move against the sensor's own motion.
  filter.start(start, noise(), 0,
               {-(first.linear + first.angular.cross(start.position)), -first.angular},
               speed_variance(0.001, 0.001));
  // Reported in intervals of so many us, in two goes, the first one amid an interval.
  const auto carried = [&](std::int64_t interval) {
    const double step = static_cast<double>(interval) * 1e-6;
    SensorMotions motions;
    for (std::int64_t begin = 0; begin < 2000000; begin += interval) {
      const double t = static_cast<double>(begin) * 1e-6;
      const Velocity a = rate(sensor(t), 0.03 + 0.04 * t);
      const Velocity b = rate(sensor(t + step), 0.03 + 0.04 * (t + step));
      const Quaterniond to_sensor = sensor(t + step / 2).rotation.conjugate();
      motions.add({begin, begin + interval, to_sensor * (b.linear - a.linear) / step,
                   to_sensor * (a.angular + b.angular) / 2,
                   to_sensor * (b.angular - a.angular) / step, 0, 0});
    }
    PoseFilter informed = filter;
    motions.propagate(informed, 734567);
    motions.forget_before(informed.utime());
    motions.propagate(informed, 2000000);
    CHECK(informed.utime() == 2000000);
    return informed.pose();
  };
  const Pose coarse = carried(20000);
  const Pose fine = carried(5000);
  CHECK(distance(coarse, seen(2)) < 1e-3);
  CHECK(angle_between(coarse, seen(2)) < 1e-4);
  // What is left is the intervals' length.
  CHECK(distance(fine, seen(2)) < distance(coarse, seen(2)) / 3);
}

TEST_CASE("A filter that cannot take a measurement reports it and is unchanged") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto kind = GENERATE(std::string("Kalman"), std::string("alpha-beta"));
  std::unique_ptr<TargetTracker> filter;
  if (kind == "Kalman") filter = std::make_unique<PoseFilter>(PoseFilterOptions{});
  if (kind == "alpha-beta") filter = std::make_unique<AlphaBetaTracker>(AlphaBetaOptions{});
  filter->start(start_pose, noise(), 0, start_velocity, speed_variance(0.01, 0.01));
  CHECK(filter->update(start_pose, noise(), 100000));
  const Matrix6d covariance = filter->covariance();
  const Pose pose = filter->pose();
  const auto refused = [&](const Pose& measured, const Matrix6d& of_it) {
    CHECK_FALSE(filter->update(measured, of_it, 500000));
    CHECK(filter->utime() == 100000);
    CHECK(distance(filter->pose(), pose) == 0);
    CHECK(filter->covariance() == covariance);
    CHECK(filter->velocity().linear == filter->velocity().linear);
  };
  Pose nowhere = start_pose;
  nowhere.position.x() = nan;
  refused(nowhere, noise());
  Matrix6d none = noise();
  none(4, 4) = nan;
  refused(start_pose, none);
  none(4, 4) = -1e-6;
  refused(start_pose, none);
  none = noise();
  none(0, 1) = none(1, 0) = 2 * none(0, 0);
  refused(start_pose, none);
  refused(start_pose, Matrix6d::Zero());
}

TEST_CASE("Returns whose information is not finite or not positive leave the Kalman filter alone") {
  PoseFilter filter({});
  filter.start(start_pose, noise(), 0, start_velocity, speed_variance(0.01, 0.01));
  const Matrix12d covariance = filter.full_covariance();
  MotionInformation bad;
  SECTION("a gradient that is not a number") {
    bad.gradient[2] = std::numeric_limits<double>::quiet_NaN();
  }
  SECTION("information that is not a number") {
    bad.information(1, 1) = std::numeric_limits<double>::quiet_NaN();
  }
  SECTION("negative information") { bad.information.diagonal().setConstant(-1e9); }
  CHECK_FALSE(filter.update(start_pose, noise(), {{start_pose, start_velocity}, bad}, 500000));
  CHECK(filter.utime() == 0);
  CHECK(distance(filter.pose(), start_pose) == 0);
  CHECK(filter.full_covariance() == covariance);
}
