// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_tracking.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimator/planning/scan_planner.h"
#include "estimator/tracking/beam_groups.h"
#include "estimator/tracking/beam_selection.h"
#include "estimator/tracking/foreground.h"
#include "estimator/tracking/open_directions.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

TEST_CASE("What batches of beams say adds up") {
  const auto model = replica_model();
  ScanMaker lidar(model->target.mesh);
  lidar.pose = paper_pose;
  lidar.velocity = {{0.02, 0, 0.01}, {0, 0.05, 0}};
  const auto scan = preprocess(lidar.sweep(around(*model, paper_pose, 1000)), {}, nominal_beam);
  const BeamLinearisation at{{paper_pose, lidar.velocity}, scan.utime_mean, Matrix6d::Zero()};
  const std::span<const Beam> beams = scan.beams;
  const BeamInformation whole = beam_information(*model, nominal_beam, beams, at, {});
  BeamInformation parts = beam_information(*model, nominal_beam, beams.first(337), at, {});
  parts += beam_information(*model, nominal_beam, beams.subspan(337), at, {});
  CHECK(parts.used == whole.used);
  CHECK(parts.predicted == whole.predicted);
  CHECK(parts.chi2 == Approx(whole.chi2));
  const MotionInformation a = whole.motion();
  const MotionInformation b = parts.motion();
  CHECK(a.information.isApprox(b.information, 1e-9));
  CHECK(a.gradient.isApprox(b.gradient, 1e-9));
  CHECK(a.returns == whole.used);
}

TEST_CASE("Groups of beams part a scan, and are found without looking at all of it") {
  for (const std::uint32_t beams : {0U, 1U, 7U, 1000U, 21517U}) {
    for (const int groups : {1, 2, 5, 12}) {
      std::vector<int> times(beams, 0);
      for (int group = 0; group < groups; ++group) {
        std::uint32_t last = 0;
        for_each_in_group(beams, group, groups, [&](std::uint32_t beam) {
          REQUIRE(beam < beams);
          CHECK(group_of(beam, groups) == group);
          CHECK(beam >= last);
          last = beam;
          ++times[beam];
        });
      }
      CHECK(std::count(times.begin(), times.end(), 1) == beams);
    }
  }
}

TEST_CASE("The information of moving beams gives pose and velocity") {
  const auto model = replica_model();
  ScanMaker lidar(model->target.mesh);
  lidar.pose = paper_pose;
  lidar.velocity = {{0.02, -0.01, 0.01}, {0.01, 0.05, 0}};
  const std::int64_t start = lidar.utime;
  const auto scan = preprocess(lidar.sweep(around(*model, paper_pose, 2000)), {}, nominal_beam);
  // Knows nothing of the motion; the reference is in the middle of the scan.
  const Pose truth =
      moved(paper_pose, lidar.velocity, static_cast<double>(scan.utime_mean - start) * 1e-6);
  BeamLinearisation at{{truth, {}}, scan.utime_mean, prior(0.03, 0.03)};
  MotionInformation told;
  for (int i = 0; i < 10; ++i) {
    told = beam_information(*model, nominal_beam, scan.beams, at, {}).motion();
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

namespace {

/// One scan of the replica about the paper's pose, as a test wants it.
struct TrackedScene {
  std::shared_ptr<const TargetModel> model = replica_model();
  BeamTrackingOptions options;
  BeamModel noise;
  ScanMaker lidar;
  Pose start = paper_pose;

  explicit TrackedScene(std::uint64_t seed = 1) : lidar(replica().mesh, seed) {
    lidar.pose = paper_pose;
  }
  std::vector<RawBeam> scan(int count) { return lidar.sweep(around(*model, start, count)); }
  TrackingResult track(const std::vector<RawBeam>& raw, const Velocity& velocity = {}) const {
    return BeamTracking(*model, noise, options)
        .track(preprocess(raw, {}, noise), {start, prior(0.03, radians(2)), velocity});
  }
};

struct Tracked {
  int ok = 0;
  int near = 0;  // within 15 mm and 1 degree
  double nees = 0;
  double error2 = 0;  // m^2, mean
};

Tracked track_many(const BeamModel& noise, ScanStrategy strategy, int trials, double start_m,
                   double start_rad) {
  const auto model = replica_model();
  const BeamTrackingOptions options;
  const BeamTracking tracking(*model, noise, options);
  const PlannerOptions planner_options;
  const ScanPlanner planner(*model, {}, planner_options);
  Random random(2, "beam tracking");
  Tracked tally;
  for (int i = 0; i < trials; ++i) {
    ScanMaker lidar(model->target.mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.beam = noise;
    lidar.pose = displaced(paper_pose, random, 0.1, radians(15));
    const Pose start = displaced(lidar.pose, random, start_m, start_rad);
    const auto raw = lidar.sweep(planner.plan(start, start_m, strategy, 2000));
    const TrackingResult result =
        tracking.track(preprocess(raw, {}, noise),
                       {start, prior(start_m / std::sqrt(3), start_rad / std::sqrt(3)), {}});
    const Vector6d error = difference(result.pose, lidar.pose);
    tally.ok += result.ok ? 1 : 0;
    tally.near += error.head<3>().norm() < 0.015 && error.tail<3>().norm() < radians(1) ? 1 : 0;
    tally.nees += error.dot(result.covariance.ldlt().solve(error)) / trials;
    tally.error2 += error.head<3>().squaredNorm() / trials;
  }
  return tally;
}

}  // namespace

TEST_CASE("Beams lead from 30 mm and 2 degrees to the millimetre, and say how near") {
  const auto strategy = GENERATE(ScanStrategy::sparse, ScanStrategy::corners_sparse);
  const Tracked tally = track_many({}, strategy, 60, 0.03, radians(2));
  CHECK(tally.ok == 60);
  CHECK(tally.near == 60);
  CHECK(std::sqrt(tally.error2) < 0.0015);
  // Six degrees of freedom; the mean of 60 has a standard deviation of 0.45.
  CHECK(tally.nees > 4.5);
  CHECK(tally.nees < 8.5);
}

TEST_CASE("Beams lead from 100 mm and 5 degrees, too") {
  const Tracked tally = track_many({}, ScanStrategy::corners_sparse, 60, 0.1, radians(5));
  CHECK(tally.ok == 60);
  CHECK(tally.near == 60);
}

TEST_CASE("Square to the beams a flat target is held by its edges") {
  // Along its panels and about their normal the ranges say nothing.
  TrackedScene scene;
  const PlannerOptions planner_options;
  const ScanPlanner planner(*scene.model, {}, planner_options);
  Random random(3, "square");
  constexpr int trials = 30;
  double nees = 0;
  int home = 0;
  for (int i = 0; i < trials; ++i) {
    scene.lidar = ScanMaker(replica().mesh, static_cast<std::uint64_t>(i) + 1);
    const Pose truth = displaced({{0, 0, 5.5}, Quaterniond::Identity()}, random, 0.1, radians(3));
    scene.lidar.pose = truth;
    scene.start = displaced(truth, random, 0.05, radians(2));
    const TrackingResult result =
        scene.track(scene.lidar.sweep(planner.plan(scene.start, 0.05, ScanStrategy::sparse, 1000)));
    INFO("trial " << i << ": " << result.reason);
    CHECK(result.ok);
    const Vector6d error = difference(result.pose, truth);
    CHECK(error.head<3>().norm() < 0.02);
    CHECK(error.tail<3>().norm() < radians(1.5));
    home += error.head<3>().norm() < 0.01 && error.tail<3>().norm() < radians(1) ? 1 : 0;
    nees += error.dot(result.covariance.ldlt().solve(error)) / trials;
  }
  CHECK(home >= 28);
  CHECK(nees < 15);  // of 6
}

TEST_CASE("Where wide beams meet edges they neither pull the pose nor hold it sharply") {
  TrackedScene scene;
  scene.options.descent.information.likelihood.footprint = true;
  const PlannerOptions planner_options;
  const ScanPlanner planner(*scene.model, {}, planner_options);
  Random random(5, "wide");
  constexpr int trials = 40;
  double nees = 0;
  int home = 0;
  for (int i = 0; i < trials; ++i) {
    scene.lidar = ScanMaker(replica().mesh, static_cast<std::uint64_t>(i) + 1);
    scene.lidar.footprint = true;
    const Pose truth = displaced({{0, 0, 5.5}, Quaterniond::Identity()}, random, 0.1, radians(10));
    scene.lidar.pose = truth;
    scene.start = displaced(truth, random, 0.02, radians(1));
    const TrackingResult result = scene.track(
        scene.lidar.sweep(planner.plan(scene.start, 0.02, ScanStrategy::information, 1000)));
    INFO("trial " << i << ": " << result.reason);
    CHECK(result.ok);
    const Vector6d error = difference(result.pose, truth);
    home += error.head<3>().norm() < 0.012 && error.tail<3>().norm() < radians(0.6) ? 1 : 0;
    nees += error.dot(result.covariance.ldlt().solve(error)) / trials;
  }
  CHECK(home >= 36);
  CHECK(nees < 12);  // of 6
}

TEST_CASE("Along an open direction a pose finds the far side of a hill") {
  const Pose start{{0.1, 0, 5}, Quaterniond::Identity()};
  Matrix6d information = 1e8 * Matrix6d::Identity();
  information(0, 0) = information(1, 1) = 1;  // along x and y nothing is known
  int asked = 0;
  const auto cost = [&](const Pose& pose) {
    ++asked;
    const double x = pose.position.x();
    return std::abs(x) + std::abs(pose.position.y() - 0.05) + (x > 0.05 && x < 0.09 ? 1 : 0);
  };
  OpenDirectionsOptions options;
  const Pose found = along_open_directions(start, information, 1.5, cost, options);
  CHECK(std::abs(found.position.x()) < options.last_m);
  CHECK(std::abs(found.position.y() - 0.05) < options.last_m);
  CHECK(found.position.z() == Approx(5));
  CHECK(angle_between(found, start) < 1e-9);
  CHECK(asked <= options.most_evaluations + 2 * options.most);
}

TEST_CASE("Where the angle noise blurs edges, they are weighed") {
  BeamModel noise;
  noise.range_sigma_m = 0.02;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 1e-3;
  const Tracked tally = track_many(noise, ScanStrategy::edges_sparse, 40, 0.03, radians(2));
  CHECK(tally.ok == 40);
  CHECK(std::sqrt(tally.error2) < 0.003);
  CHECK(tally.nees < 9);
}

TEST_CASE("Returns are used at their own times") {
  TrackedScene scene;
  scene.lidar.velocity = {{0.03, 0, -0.05}, {0, 0, 0.05}};
  const std::int64_t first = scene.lidar.utime;
  const auto raw = scene.scan(4000);
  const CleanScan scan = preprocess(raw, {}, scene.noise);
  const Pose truth =
      moved(paper_pose, scene.lidar.velocity, static_cast<double>(scan.utime_mean - first) * 1e-6);
  scene.start = truth;
  const TrackingResult result = scene.track(raw, scene.lidar.velocity);
  REQUIRE(result.ok);
  CHECK(distance(result.pose, truth) < 0.003);
  CHECK(angle_between(result.pose, truth) < radians(0.3));
  scene.options.deskew = false;
  const TrackingResult worse = scene.track(raw, scene.lidar.velocity);
  CHECK(difference(worse.pose, truth).norm() > difference(result.pose, truth).norm());
}

TEST_CASE("A velocity that is only supposed is measured with the pose, and doubted with it") {
  const auto model = replica_model();
  const BeamTrackingOptions options;
  const BeamTracking tracking(*model, nominal_beam, options);
  Random random(6, "velocity");
  constexpr int trials = 60;
  double nees = 0;
  double error2 = 0;
  double believed2 = 0;
  for (int i = 0; i < trials; ++i) {
    ScanMaker lidar(replica().mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.pose = displaced(paper_pose, random, 0.1, radians(15));
    lidar.velocity = {random.normal_vector(0.01), random.normal_vector(0.02)};
    const Pose start = lidar.pose;
    const std::int64_t first = lidar.utime;
    const auto scan = preprocess(lidar.sweep(around(*model, start, 3000)), {}, nominal_beam);
    const Pose truth =
        moved(start, lidar.velocity, static_cast<double>(scan.utime_mean - first) * 1e-6);
    Prediction predicted{displaced(truth, random, 0.01, radians(0.5)), prior(0.01, 0.01), {}};
    believed2 += difference(tracking.track(scan, predicted).pose, truth).squaredNorm();
    predicted.velocity_covariance = prior(0.01, 0.02);
    const TrackingResult result = tracking.track(scan, predicted);
    const Vector6d error = difference(result.pose, truth);
    nees += error.dot(result.covariance.ldlt().solve(error)) / trials;
    error2 += error.squaredNorm();
    REQUIRE(result.motion);
  }
  CHECK(nees > 4.5);
  CHECK(nees < 8);
  CHECK(error2 < 0.5 * believed2);
}

TEST_CASE("Noisy angles make no motion of a target at rest") {
  // Mirrors move steadily: time tells better than the angles where a beam went.
  const auto model = replica_model();
  BeamModel noise;
  noise.range_sigma_m = 0.02;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 1e-3;
  const BeamTrackingOptions options;
  const BeamTracking tracking(*model, noise, options);
  Random random(8, "noisy angles");
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    ScanMaker lidar(replica().mesh, seed);
    lidar.beam = noise;
    lidar.rate_hz = 200000;
    lidar.pose = paper_pose;
    const CleanScan scan = preprocess(lidar.sweep(around(*model, paper_pose, 100000)), {}, noise);
    Prediction predicted{displaced(paper_pose, random, 0.01, radians(0.5)), prior(0.01, 0.01), {}};
    const Matrix6d resting = tracking.track(scan, predicted).covariance;
    predicted.velocity_covariance = prior(0.006, 0.006);
    const TrackingResult result = tracking.track(scan, predicted);
    const Vector6d error = difference(result.pose, paper_pose);
    CHECK(error.tail<3>().norm() < radians(0.2));
    CHECK(error.dot(result.covariance.ldlt().solve(error)) < 22);  // 99.9 % of a chi squared of 6
    CHECK(result.covariance.trace() > resting.trace());
  }
}

namespace {

/// Mean error of scans of so many beams over the whole target, in standard deviations.
Vector6d mean_error(const BeamModel& noise, int beams, int scans) {
  const auto model = replica_model();
  const BeamTrackingOptions options;
  const BeamTracking tracking(*model, noise, options);
  Random random(12, "mean error");
  Vector6d sum = Vector6d::Zero();
  for (int i = 0; i < scans; ++i) {
    ScanMaker lidar(replica().mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.beam = noise;
    lidar.pose = displaced(paper_pose, random, 0.1, radians(10));
    const CleanScan scan = preprocess(lidar.sweep(around(*model, lidar.pose, beams)), {}, noise);
    const Prediction predicted{
        displaced(lidar.pose, random, 0.01, radians(0.5)), prior(0.01, 0.01), {}};
    const TrackingResult result = tracking.track(scan, predicted);
    sum +=
        difference(lidar.pose, result.pose).cwiseQuotient(result.covariance.diagonal().cwiseSqrt());
  }
  return sum / scans;
}

}  // namespace

TEST_CASE("Noisy ranges of many beams near edges do not turn the target") {
  BeamModel noise;
  noise.range_sigma_m = 0.02;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 1e-3;
  // Of 12 scans: 99.9 % of a normal distribution. A lever as long as each range turns it by 1.5.
  CHECK(mean_error(noise, 60000, 12).tail<3>().cwiseAbs().maxCoeff() < 1);
}

TEST_CASE("What stands a little before a face does not draw it near") {
  BeamModel noise;
  noise.range_sigma_m = 0.02;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 1e-4;
  // Of 24 scans: 99.9 %. Taken for the face behind, such returns make 0.8.
  CHECK(std::abs(mean_error(noise, 150000, 24).z()) < 0.65);
}

TEST_CASE("Beside what stands before a face beams are doubtful for as far as noise takes them") {
  Target steps;
  steps.mesh = make_box({2, 2, 0.01});
  steps.mesh.append(make_box({1, 2, 0.01}), Pose{{-0.5, 0, -0.3}, Quaterniond::Identity()});
  steps.hash = content_hash(steps.mesh);
  steps.length = 2;
  const auto model = compile_target_model(steps, {});
  BeamModel noise;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = 1e-3;
  ScanMaker lidar(steps.mesh);
  lidar.beam = BeamModel{0, 0, 0};
  lidar.pose = Pose{{0, 0, 8}, Quaterniond::Identity()};
  BeamLinearisation at;
  at.pose = lidar.pose;
  BeamInformationOptions faces;
  faces.edges = false;
  const auto doubtful = [&](double sigmas) {
    const auto scan = preprocess({lidar.shoot(sigmas * noise.azimuth_sigma_rad, 0.02)}, {}, noise);
    std::vector<MetFace> at_edges;
    const std::vector<std::uint32_t> picks{0};
    beam_information(*model, noise, scan.beams, at, faces, picks, at_edges);
    return at_edges.size() == 1;
  };
  for (const double sigmas : {-2.4, -1.0, 0.5, 1.0, 1.5, 2.0, 2.4}) CHECK(doubtful(sigmas));
  for (const double sigmas : {-4.0, 4.0}) CHECK(!doubtful(sigmas));
}

TEST_CASE("After a small step doubtful beams need no cast to say what they say with one") {
  const auto model = replica_model();
  ScanMaker lidar(model->target.mesh);
  lidar.beam = nominal_beam;
  lidar.pose = paper_pose;
  const auto scan = preprocess(lidar.sweep(around(*model, paper_pose, 5000)), {}, nominal_beam);
  const Foreground foreground(*model, paper_pose.inverse().position);
  BeamInformationOptions faces;
  faces.edges = false;
  faces.misses = false;
  const auto at = [&](const Pose& pose, double sigma_m) {
    return BeamLinearisation{{pose, {}}, scan.utime_mean, prior(sigma_m, sigma_m)};
  };
  std::vector<MetFace> doubtful;
  const BeamInformation certain =
      beam_information(*model, nominal_beam, scan.beams, at(paper_pose, 0.003), faces,
                       select_beams(scan, 100, 100).all, doubtful, &foreground);
  REQUIRE(doubtful.size() > 200);
  BeamPicks picks;
  for (const MetFace& met : doubtful) picks.push_back(met.beam);

  Random random(6, "moved");
  constexpr int steps = 20;
  double differ = 0;
  for (int i = 0; i < steps; ++i) {
    // Less than the angle noise, by which beams are doubtful anyhow.
    const auto moved = at(displaced(paper_pose, random, 0.0005, 0.0002), 0.0002);
    std::vector<MetFace> left_cast;
    std::vector<MetFace> left;
    const BeamInformation cast = beam_information(*model, nominal_beam, scan.beams, moved, faces,
                                                  picks, left_cast, &foreground);
    const BeamInformation again = beam_information(*model, nominal_beam, scan.beams, moved, faces,
                                                   doubtful, left, &foreground);
    CHECK(cast.used > 50);
    // Where three faces meet one beam in a hundred may be doubted by one way only.
    CHECK(std::abs(again.used - cast.used) <= 3);
    CHECK(std::abs(static_cast<int>(left.size()) - static_cast<int>(left_cast.size())) <= 3);
    const Vector6d differs = again.gradient[0] - cast.gradient[0];
    differ += differs.dot(certain.information[0].ldlt().solve(differs));
  }
  CHECK(differ / steps < 0.3);  // variances of the pose, by one return or two of hundreds
}

TEST_CASE("What has come past an end since it was last met is cast, the rest need not be") {
  const auto model = replica_model();
  ScanMaker lidar(model->target.mesh);
  lidar.beam = nominal_beam;
  lidar.pose = paper_pose;
  const auto scan = preprocess(lidar.sweep(around(*model, paper_pose, 5000)), {}, nominal_beam);
  const Foreground foreground(*model, paper_pose.inverse().position);
  BeamInformationOptions faces;
  faces.edges = false;
  faces.misses = false;
  const auto at = [&](const Pose& pose) {
    return BeamLinearisation{{pose, {}}, scan.utime_mean, prior(0.0002, 0.0002)};
  };
  std::vector<MetFace> doubtful;
  const BeamInformation certain =
      beam_information(*model, nominal_beam, scan.beams, at(paper_pose), faces,
                       select_beams(scan, 100, 100).all, doubtful, &foreground);
  std::vector<MetFace> unknown = doubtful;
  for (MetFace& met : unknown) met.triangle = MetFace::unknown;

  Random random(8, "moved");
  constexpr int steps = 20;
  double stale = 0;
  double mended = 0;
  for (int i = 0; i < steps; ++i) {
    const auto moved = at(displaced(paper_pose, random, 0.001, 0.0004));
    const auto gradient = [&](const BeamInformation& said) { return said.gradient[0]; };
    const Vector6d cast =
        gradient(beam_information(*model, nominal_beam, scan.beams, moved, faces, unknown));
    const auto differs = [&](const BeamInformation& said) {
      const Vector6d d = gradient(said) - cast;
      return d.dot(certain.information[0].ldlt().solve(d));
    };
    stale += differs(beam_information(*model, nominal_beam, scan.beams, moved, faces, doubtful));
    mended += differs(
        beam_information(*model, nominal_beam, scan.beams, moved, faces, doubtful, foreground));
  }
  CAPTURE(stale, mended);
  CHECK(mended < 0.2 * stale);
}

TEST_CASE("The same scan gives the same bits") {
  TrackedScene scene;
  const auto raw = scene.scan(3000);
  const TrackingResult a = scene.track(raw);
  const TrackingResult b = scene.track(raw);
  CHECK(a.pose.position == b.pose.position);
  CHECK(a.pose.rotation.coeffs() == b.pose.rotation.coeffs());
  CHECK(a.covariance == b.covariance);
}

TEST_CASE("Hits and misses about edges tell more than faces alone") {
  TrackedScene scene;
  scene.lidar.beam.range_sigma_m = scene.noise.range_sigma_m = 0.02;
  Random random(5, "edges");
  double with = 0;
  double without = 0;
  for (int i = 0; i < 30; ++i) {
    scene.lidar.pose = displaced(paper_pose, random, 0.1, radians(15));
    scene.start = displaced(scene.lidar.pose, random, 0.03, radians(2));
    const auto raw = scene.scan(3000);
    scene.options.descent.edge_rest = {0, 20000};
    with += difference(scene.track(raw).pose, scene.lidar.pose).head<3>().squaredNorm();
    scene.options.descent.edge_rest.most_beams = 0;
    without += difference(scene.track(raw).pose, scene.lidar.pose).head<3>().squaredNorm();
  }
  CHECK(with < 0.7 * without);
}

TEST_CASE("Edges of a target before a wall are as sharp as in free space") {
  Mesh wall;
  wall.append(make_box({20, 20, 0.1}), {{0, 0, 13}, Quaterniond::Identity()});
  double free = 0;
  double before_wall = 0;
  Random random(6, "walls");
  for (int i = 0; i < 20; ++i) {
    const auto seed = static_cast<std::uint64_t>(i) + 1;
    TrackedScene in_space(seed);
    TrackedScene in_cell(seed);
    in_cell.lidar.add_clutter(wall);
    in_space.lidar.pose = in_cell.lidar.pose = displaced(paper_pose, random, 0.1, radians(15));
    in_space.start = in_cell.start = displaced(in_space.lidar.pose, random, 0.03, radians(2));
    const auto error2 = [](TrackedScene& scene) {
      return difference(scene.track(scene.scan(1000)).pose, scene.lidar.pose).squaredNorm();
    };
    free += error2(in_space);
    before_wall += error2(in_cell);
  }
  // Some of what is behind returns, as the likelihood supposes; nothing does in free space.
  CHECK(before_wall < 2 * free);
}

TEST_CASE("The order of the beams does not matter") {
  constexpr int trials = 5;
  double apart = 0;
  for (std::uint64_t seed = 1; seed <= trials; ++seed) {
    TrackedScene scene(seed);
    scene.options.descent.edge_rest.least_gain = 0;  // else it decides which are looked at
    auto raw = scene.scan(3000);
    const TrackingResult a = scene.track(raw);
    Random random(4, "shuffle");
    for (std::size_t i = raw.size(); i > 1; --i) {
      std::swap(raw[i - 1],
                raw[static_cast<std::size_t>(random.uniform() * static_cast<double>(i))]);
    }
    const TrackingResult b = scene.track(raw);
    REQUIRE(a.ok);
    REQUIRE(b.ok);
    const Vector6d d = difference(a.pose, b.pose);
    apart += d.dot(a.covariance.ldlt().solve(d)) / trials;
  }
  // Other beams begin; the same decide. Well within a standard deviation.
  CHECK(apart < 3);
}

TEST_CASE("Turned about the sensor, all turns along") {
  TrackedScene scene;
  scene.options.descent.edge_rest.least_gain =
      0;  // else rounding decides when enough are looked at
  const CleanScan scan = preprocess(scene.scan(3000), {}, scene.noise);
  const Pose turn{Vector3d::Zero(), rotation_from_vector({0.05, -0.1, 0.7})};
  CleanScan turned = scan;
  for (Beam& beam : turned.beams) beam.direction = turn.rotation * beam.direction;
  for (Vector3d& point : turned.points) point = turn * point;
  const BeamTracking tracking(*scene.model, scene.noise, scene.options);
  const Matrix6d covariance = prior(0.03, radians(2));  // the same in all directions
  const TrackingResult a = tracking.track(scan, {scene.start, covariance, {}});
  const TrackingResult b = tracking.track(turned, {turn * scene.start, covariance, {}});
  // Rounding puts single beams at edges on another side.
  CHECK(distance(turn * a.pose, b.pose) < 2e-4);
  CHECK(angle_between(turn * a.pose, b.pose) < 2e-4);
}

TEST_CASE("Half the target behind something else is enough") {
  TrackedScene scene;
  Mesh screen;
  screen.append(make_box({2, 4, 0.02}), {{1.1, -0.2, 6.5}, Quaterniond::Identity()});
  scene.lidar.add_clutter(screen);
  const TrackingResult result = scene.track(scene.scan(4000));
  INFO(result.reason);
  REQUIRE(result.ok);
  CHECK(distance(result.pose, paper_pose) < 0.01);
  CHECK(angle_between(result.pose, paper_pose) < radians(1));
}

TEST_CASE("A third of outliers does not disturb") {
  TrackedScene scene;
  Random random(1, "strays");
  scene.start = displaced(paper_pose, random, 0.03, radians(2));
  auto raw = scene.scan(4000);
  for (RawBeam& b : raw) {
    if (random.uniform() < 0.3 && b.status == BeamStatus::hit) b.range = random.uniform(4, 12);
  }
  const TrackingResult result = scene.track(raw);
  INFO(result.reason);
  REQUIRE(result.ok);
  CHECK(distance(result.pose, paper_pose) < 0.006);
  CHECK(angle_between(result.pose, paper_pose) < radians(0.5));
}

TEST_CASE("A model that is a little wrong is survived") {
  TrackedScene scene;
  Mesh real = replica().mesh;
  SECTION("a panel is not there") {
    Mesh less;
    less.vertices = real.vertices;
    for (std::size_t i = 12; i < real.triangles.size(); ++i)
      less.triangles.push_back(real.triangles[i]);
    real = less;
  }
  SECTION("a panel stands 10 mm too far out") {
    std::vector<bool> moved_already(real.vertices.size(), false);
    for (std::size_t i = 0; i < 12; ++i) {
      for (const std::uint32_t v : real.triangles[i]) {
        if (!moved_already[v]) real.vertices[v].z() -= 0.01;
        moved_already[v] = true;
      }
    }
  }
  scene.lidar = ScanMaker(real, 1);
  scene.lidar.pose = paper_pose;
  const TrackingResult result = scene.track(scene.scan(4000));
  INFO(result.reason);
  REQUIRE(result.ok);
  CHECK(distance(result.pose, paper_pose) < 0.015);
  CHECK(angle_between(result.pose, paper_pose) < radians(1));
}

TEST_CASE("A scan that contradicts the pose is not ok, and says why") {
  TrackedScene scene;
  const auto track = [&](const Mesh& mesh, const Pose& truth) {
    scene.lidar = ScanMaker(mesh, 1);
    scene.lidar.pose = truth;
    const TrackingResult result = scene.track(scene.scan(3000));
    INFO(result.reason);
    CHECK_FALSE(result.ok);
    CHECK_FALSE(result.reason.empty());
    return result;
  };
  SECTION("the target is elsewhere") { track(replica().mesh, {{1.5, 1, 8}, paper_pose.rotation}); }
  SECTION("it is another target") { track(make_box({3, 1.2, 0.6}), paper_pose); }
  SECTION("only a wall is there") {
    scene.start = {{0, 0, 8}, Quaterniond::Identity()};
    track(make_box({20, 20, 0.01}), {{0, 0, 8}, Quaterniond::Identity()});
  }
  SECTION("nothing is there") {
    CHECK(track(replica().mesh, {{0, 0, 500}, Quaterniond::Identity()}).used == 0);
  }
}

TEST_CASE("Scans with next to nothing in them have a clear status") {
  TrackedScene scene;
  auto raw = scene.scan(2000);
  CHECK_FALSE(scene.track({}).ok);
  const auto hit = std::find_if(raw.begin(), raw.end(),
                                [](const RawBeam& b) { return b.status == BeamStatus::hit; });
  const TrackingResult one = scene.track({*hit});
  CHECK_FALSE(one.ok);
  CHECK_FALSE(one.reason.empty());
  auto misses = raw;
  for (RawBeam& b : misses) b.status = BeamStatus::miss;
  CHECK_FALSE(scene.track(misses).ok);
  auto broken = raw;
  for (std::size_t i = 0; i < broken.size(); i += 3) {
    broken[i].range = i % 2 == 0 ? std::nan("") : -1;
    broken[i].status = BeamStatus::hit;
  }
  const TrackingResult rest = scene.track(broken);
  CHECK(rest.ok);
  CHECK(distance(rest.pose, paper_pose) < 0.006);
  scene.start.position.x() = std::nan("");
  CHECK_FALSE(scene.track(raw).ok);
}
