// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/alpha_beta_tracker.h"

#include <Eigen/Cholesky>

#include "common/core/random.h"
#include "test/catch.h"
#include "test/estimator/filter/noisy_poses.h"

using namespace berth;
using namespace berth::estimator;

namespace {

const Pose start = pose_from_xyzwpr({0, 0, 5000, 10, 20, 30});
const Velocity velocity{{0.01, -0.02, -0.03}, {0.02, 0.01, -0.03}};

}  // namespace

TEST_CASE("A target at constant velocity is followed without error") {
  AlphaBetaTracker tracker({});
  tracker.start(start, noise(), 0);
  for (int i = 1; i <= 30; ++i) {
    const std::int64_t t = i * 500000;
    REQUIRE(tracker.update(moved(start, velocity, 0.5 * i), noise(), t));
  }
  CHECK(distance(tracker.pose(), moved(start, velocity, 15)) < 1e-6);
  CHECK((tracker.velocity().linear - velocity.linear).norm() < 1e-6);
  CHECK((tracker.velocity().angular - velocity.angular).norm() < 1e-6);
  // and predicted
  const Pose truth = moved(start, velocity, 16);
  CHECK(distance(tracker.predict(16000000), truth) < 1e-5);
  CHECK(angle_between(tracker.predict(16000000), truth) < 1e-5);
}

TEST_CASE("Two measurements are enough for a velocity") {
  AlphaBetaTracker tracker({});
  tracker.start(start, noise(), 0);
  REQUIRE(tracker.update(moved(start, velocity, 0.7), noise(), 700000));
  CHECK((tracker.velocity().linear - velocity.linear).norm() < 1e-9);
}

TEST_CASE("The filter smooths, and its covariances are consistent") {
  AlphaBetaOptions options;
  options.alpha = 0.5;
  options.beta = 0.15;
  options.linear_acceleration = 1e-6;
  options.angular_acceleration = 1e-6;
  double raw = 0;
  double filtered = 0;
  double nees = 0;
  double nees_velocity = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed, "filter");
    AlphaBetaTracker tracker(options);
    tracker.start(measured(start, random), noise(), 0);
    for (int i = 1; i <= 40; ++i) {
      const Pose truth = moved(start, velocity, 0.5 * i);
      const Pose m = measured(truth, random);
      REQUIRE(tracker.update(m, noise(), i * 500000));
      if (i < 20 || i % 5 != 0) continue;
      const Vector6d error = difference(tracker.pose(), truth);
      Vector6d velocity_error;
      velocity_error << velocity.linear - tracker.velocity().linear,
          velocity.angular - tracker.velocity().angular;
      raw += (m.position - truth.position).squaredNorm();
      filtered += error.head<3>().squaredNorm();
      nees += error.dot(tracker.covariance().ldlt().solve(error)) / 6;
      nees_velocity +=
          velocity_error.dot(tracker.velocity_covariance().ldlt().solve(velocity_error)) / 6;
      ++count;
    }
  }
  CHECK(filtered < 0.7 * raw);
  CHECK(nees / count == Approx(1).margin(0.15));
  CHECK(nees_velocity / count == Approx(1).margin(0.15));
}

TEST_CASE("What is predicted far ahead is less certain") {
  AlphaBetaTracker tracker({});
  tracker.start(start, noise(), 0);
  for (int i = 1; i <= 10; ++i) REQUIRE(tracker.update(start, noise(), i * 500000));
  const double now = tracker.predicted_covariance(5000000).trace();
  const double soon = tracker.predicted_covariance(5500000).trace();
  const double later = tracker.predicted_covariance(8000000).trace();
  CHECK(now < soon);
  CHECK(soon < later);
}

TEST_CASE("A measurement of the same time corrects the pose and leaves the velocity") {
  AlphaBetaTracker tracker({});
  tracker.start(start, noise(), 0);
  REQUIRE(tracker.update(moved(start, velocity, 1), noise(), 1000000));
  const Velocity before = tracker.velocity();
  REQUIRE(tracker.update(start, noise(), 1000000));
  CHECK(tracker.velocity().linear == before.linear);
  CHECK(std::isfinite(tracker.pose().position.norm()));
  CHECK(std::isfinite(tracker.covariance().trace()));
}

TEST_CASE("A full turn of the target is followed across every angle") {
  AlphaBetaTracker tracker({});
  const Velocity spin{{0, 0, 0}, {0, 0.1, 0}};
  tracker.start(start, noise(), 0);
  for (int i = 1; i <= 140; ++i) {
    const Pose truth = moved(start, spin, 0.5 * i);
    REQUIRE(tracker.update(truth, noise(), i * 500000));
    REQUIRE(angle_between(tracker.pose(), truth) < 1e-3);
  }
}
