// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/bounded_hough.h"

#include "estimator/plan/scan_planner.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

Vector6d displacement(Random& random, double translation, double rotation) {
  Vector6d d;
  for (int i = 0; i < 3; ++i) d[i] = random.uniform(-translation, translation);
  for (int i = 3; i < 6; ++i) d[i] = random.uniform(-rotation, rotation);
  return d;
}

/// The pose that is displaced about the model's centre, in the model's own axes.
Pose displaced(const Pose& pose, const Vector3d& centre, const Vector6d& d) {
  const Quaterniond q = rotation_from_vector(d.tail<3>());
  return pose * Pose{centre + d.head<3>() - q * centre, q};
}

double error_at_centre(const Pose& a, const Pose& b, const Vector3d& centre) {
  return (a * centre - b * centre).norm();
}

PreprocessedScan scan_of(ScanMaker& lidar, int beams) {
  return preprocess(lidar.sweep(around(*replica_model(), lidar.pose, beams)), {}, nominal_beam);
}

}  // namespace

TEST_CASE("Votes find the pose anywhere within the bounds to two of the finest cells") {
  const auto model = replica_model();
  const BoundedHoughOptions options;
  const BoundedHough hough(*model, options);
  Random random(5, "votes");
  const double cells = options.reach * std::pow(2, options.levels - 1);  // within the bound
  constexpr int trials = 30;
  for (int i = 0; i < trials; ++i) {
    ScanMaker lidar(model->target.mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.pose = perturbed(paper_pose, displacement(random, 0.1, radians(10)));
    const Pose truth = lidar.pose;
    const PreprocessedScan scan = scan_of(lidar, 1500);
    const Pose expected = displaced(
        truth, model->centre, displacement(random, 0.9 * hough.bound_m(), 0.9 * hough.bound_rad()));
    const auto result = hough.vote(scan.points, expected);
    CHECK(result.votes <= result.voters);
    CHECK(error_at_centre(result.pose, truth, model->centre) < 2 * hough.bound_m() / cells);
    CHECK(angle_between(result.pose, truth) < 2 * std::sqrt(3) * hough.bound_rad() / cells);
  }
}

TEST_CASE("Without returns the expected pose stays") {
  const BoundedHough hough(*replica_model(), {});
  CHECK(hough.vote({}, paper_pose).voters == 0);
  CHECK(distance(hough.vote({}, paper_pose).pose, paper_pose) == 0);
  const auto elsewhere = hough.vote({Vector3d(0, 0, 100)}, paper_pose);
  CHECK(elsewhere.voters == 0);
  CHECK(distance(elsewhere.pose, paper_pose) == 0);
}

TEST_CASE("A motion from frame to frame is followed, and one beyond the bounds is not ok") {
  const auto model = replica_model();
  const IcpTrackingOptions refinement;
  const BoundedHoughTracking tracking(*model, nominal_beam, {}, refinement);
  Random random(6, "frames");
  ScanMaker lidar(model->target.mesh);
  lidar.rate_hz = 1e7;  // at rest while it is scanned
  lidar.pose = paper_pose;
  Pose last = paper_pose;
  const Matrix6d loose = Matrix6d::Identity();
  for (int frame = 0; frame < 12; ++frame) {
    lidar.pose = displaced(lidar.pose, model->centre, displacement(random, 0.08, radians(4)));
    const TrackingResult result = tracking.track(scan_of(lidar, 1500), {last, loose, {}});
    INFO(result.reason);
    REQUIRE(result.ok);
    CHECK(error_at_centre(result.pose, lidar.pose, model->centre) < 0.01);
    CHECK(angle_between(result.pose, lidar.pose) < radians(1));
    last = result.pose;
  }
  Vector6d jump;
  jump << 0.5, 0.4, 0, 0, 0, 0.5;
  lidar.pose = displaced(lidar.pose, model->centre, jump);
  CHECK_FALSE(tracking.track(scan_of(lidar, 1500), {last, loose, {}}).ok);
}
