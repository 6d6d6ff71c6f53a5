// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/single_scan.h"

#include <limits>

#include "test/catch.h"
#include "test/estimator/single_scan_fixture.h"

using namespace berth;
using namespace berth::estimator;
using Catch::Contains;
using Status = SingleScanResult::Status;

TEST_CASE("A scan that stands alone gives a refined pose and its covariance") {
  const SingleScanFixture f;
  const SingleScanResult result = f.estimate(f.scan(4000));
  REQUIRE(result.status == Status::ok);
  CHECK(result.reason.empty());
  CHECK(result.acquired);
  REQUIRE(result.candidates.size() == 1);
  const PoseCandidate& best = result.candidates.front();
  CHECK(best.probability > 0.9);
  CHECK(best.used > 500);
  CHECK(distance(best.pose, f.truth) < 0.02);
  CHECK(angle_between(best.pose, f.truth) < radians(1));
  REQUIRE(best.covariance);
  CHECK(best.covariance->isApprox(best.covariance->transpose()));
  CHECK(best.covariance->diagonal().minCoeff() > 0);
  CHECK(best.covariance->diagonal().maxCoeff() < 1e-3);
}

TEST_CASE("The same scan gives the same bits") {
  const SingleScanFixture f;
  const auto beams = f.scan(3000);
  const SingleScanResult a = f.estimate(beams);
  const SingleScanResult b = f.estimate(beams);
  REQUIRE(a.candidates.size() == b.candidates.size());
  CHECK(a.candidates.front().pose.position == b.candidates.front().pose.position);
  CHECK(a.candidates.front().pose.rotation.coeffs() == b.candidates.front().pose.rotation.coeffs());
}

TEST_CASE("From an initial pose the target is tracked, not acquired") {
  const SingleScanFixture f;
  Vector6d off;
  off << 0.03, -0.02, 0.04, 0.02, 0.03, -0.02;
  const SingleScanResult result = f.estimate(f.scan(4000), perturbed(f.truth, off));
  REQUIRE(result.status == Status::ok);
  CHECK_FALSE(result.acquired);
  CHECK(result.notes.empty());
  CHECK(f.is_right(result.candidates.front().pose));
}

TEST_CASE("From a wrong initial pose the target is acquired, and a note reports it") {
  const SingleScanFixture f;
  const Pose initial = pose_from_xyzwpr({-900, 200, 9000, 0, 0, 90});
  const SingleScanResult result = f.estimate(f.scan(4000), initial);
  REQUIRE(result.status == Status::ok);
  CHECK(result.acquired);
  REQUIRE(result.notes.size() == 1);
  CHECK_THAT(result.notes[0], Contains("initial pose"));
  CHECK(f.is_right(result.candidates.front().pose));
}

TEST_CASE("A target far beyond the configured LIDAR's range, or nearer, is found all the same") {
  SingleScanFixture f;
  f.truth.position = {0, 0, 2.5};
  CHECK(f.estimate(f.scan(4000)).status == Status::ok);
  f.truth.position = {0, 0, 900};
  f.beam_model.azimuth_sigma_rad = f.beam_model.elevation_sigma_rad = 1e-6;
  const SingleScanResult result = f.estimate(hits_of(f.scan(400000)));
  CHECK_FALSE(f.silently_wrong(result));
  CHECK_THAT(result.reason, !Contains("returned"));
}

TEST_CASE("Scans with nothing in them are lost, each with a reason") {
  const SingleScanFixture f;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const auto beams = [](std::size_t count, double range, BeamStatus status) {
    std::vector<RawBeam> scan(count);
    for (std::size_t i = 0; i < count; ++i) {
      scan[i] = {0, range, 1e-4 * static_cast<double>(i), 0, status, 0};
    }
    return scan;
  };
  std::vector<RawBeam> nowhere = beams(1000, 5, BeamStatus::hit);
  for (RawBeam& beam : nowhere) beam.azimuth = nan;
  std::vector<RawBeam> one = beams(1000, 0, BeamStatus::miss);
  one[3] = {0, 5, 0, 0, BeamStatus::hit, 0};
  const std::vector<std::pair<std::string, std::vector<RawBeam>>> scans = {
      {"empty", {}},
      {"one return", beams(1, 5, BeamStatus::hit)},
      {"one return among misses", one},
      {"all misses", beams(1000, 0, BeamStatus::miss)},
      {"NaN ranges", beams(1000, nan, BeamStatus::hit)},
      {"infinite ranges", beams(1000, inf, BeamStatus::hit)},
      {"zero ranges", beams(1000, 0, BeamStatus::hit)},
      {"negative ranges", beams(1000, -5, BeamStatus::hit)},
      {"NaN angles", nowhere},
      {"one place", std::vector<RawBeam>(1000, one[3])},
      {"a line", beams(1000, 5, BeamStatus::hit)},
  };
  for (const auto& [what, scan] : scans) {
    CAPTURE(what);
    const SingleScanResult result = f.estimate(scan);
    CHECK(result.status == Status::lost);
    CHECK_FALSE(result.reason.empty());
    const SingleScanResult tracked = f.estimate(scan, f.truth);
    CHECK(tracked.status == Status::lost);
    CHECK_FALSE(tracked.reason.empty());
  }
}
