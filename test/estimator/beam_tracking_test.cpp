// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_tracking.h"

#include <Eigen/Cholesky>

#include "estimator/planning/scan_planner.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

const BeamModel beam_model;
/// The paper's pose (section 5.3.1).
const Pose paper_pose = pose_from_xyzwpr({100, -230, 8000, 25, 20, -30});

Matrix6d prior(double translation, double rotation) {
  Vector6d v;
  v << Vector3d::Constant(translation * translation), Vector3d::Constant(rotation * rotation);
  return v.asDiagonal();
}

Pose displaced(const Pose& pose, Random& random, double translation, double rotation) {
  Vector6d d;
  d << translation * random.normal_vector(1).normalized(),
      rotation * random.normal_vector(1).normalized();
  return perturbed(pose, d);
}

}  // namespace

TEST_CASE("What batches of beams say adds up") {
  const auto model = replica_model();
  ScanMaker lidar(model->target.mesh);
  lidar.pose = paper_pose;
  lidar.velocity = {{0.02, 0, 0.01}, {0, 0.05, 0}};
  const auto scan = preprocess(lidar.sweep(around(*model, paper_pose, 1000)), {}, beam_model);
  const BeamLinearisation at{paper_pose, lidar.velocity, scan.utime_mean, Matrix6d::Zero()};
  const std::span<const Beam> beams = scan.beams;
  const BeamInformation whole = beam_information(*model, beam_model, beams, at, {});
  BeamInformation parts = beam_information(*model, beam_model, beams.first(337), at, {});
  parts += beam_information(*model, beam_model, beams.subspan(337), at, {});
  CHECK(parts.used == whole.used);
  CHECK(parts.predicted == whole.predicted);
  CHECK(parts.chi2 == Approx(whole.chi2));
  const MotionInformation a = whole.motion();
  const MotionInformation b = parts.motion();
  CHECK(a.information.isApprox(b.information, 1e-9));
  CHECK(a.gradient.isApprox(b.gradient, 1e-9));
  CHECK(a.returns == whole.used);
}

TEST_CASE("The information of moving beams gives pose and velocity") {
  const auto model = replica_model();
  ScanMaker lidar(model->target.mesh);
  lidar.pose = paper_pose;
  lidar.velocity = {{0.02, -0.01, 0.01}, {0.01, 0.05, 0}};
  const std::int64_t start = lidar.utime;
  const auto scan = preprocess(lidar.sweep(around(*model, paper_pose, 2000)), {}, beam_model);
  // Knows nothing of the motion; the reference is in the middle of the scan.
  const Pose truth =
      moved(paper_pose, lidar.velocity, static_cast<double>(scan.utime_mean - start) * 1e-6);
  BeamLinearisation at{truth, {}, scan.utime_mean, prior(0.03, 0.03)};
  MotionInformation told;
  for (int i = 0; i < 10; ++i) {
    told = beam_information(*model, beam_model, scan.beams, at, {}).motion();
    const Vector12d d = told.information.ldlt().solve(told.gradient);
    at.pose = perturbed(at.pose, d.head<6>());
    at.velocity.linear += d.segment<3>(6);
    at.velocity.angular += d.tail<3>();
    at.covariance = prior(0.005, 0.005);
  }
  Vector12d error;
  error << difference(at.pose, truth), lidar.velocity.linear - at.velocity.linear,
      lidar.velocity.angular - at.velocity.angular;
  CHECK(error.dot(told.information * error) < 33);  // 99.9 % of a chi squared of 12
  CHECK(distance(at.pose, truth) < 0.01);
  CHECK((at.velocity.angular - lidar.velocity.angular).norm() < 0.025);
}

TEST_CASE("Beams lead from 30 mm and 2 degrees to the millimetre") {
  const auto model = replica_model();
  const BeamTrackingOptions options;
  const BeamTracking tracking(*model, beam_model, options);
  const PlannerOptions planner_options;
  const ScanPlanner planner(*model, {}, planner_options);
  Random random(2, "beam tracking");
  for (int i = 0; i < 50; ++i) {
    ScanMaker lidar(model->target.mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.pose = displaced(paper_pose, random, 0.1, radians(15));
    const Pose start = displaced(lidar.pose, random, 0.03, radians(2));
    const auto raw = lidar.sweep(planner.plan(start, 0.03, ScanStrategy::corners_sparse, 1000));
    const TrackingResult result =
        tracking.track(preprocess(raw, {}, beam_model), {start, prior(0.03, radians(2)), {}});
    CHECK(result.ok);
    CHECK(distance(result.pose, lidar.pose) < 0.015);
    CHECK(angle_between(result.pose, lidar.pose) < radians(1));
  }
}
